//! From a frame and hints to a mask.

use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;

use super::bitmap::Bitmap;
use super::initial::InitialLabels;
use super::settings::{MAX_PIXELS, MIN_SIDE};
use super::{Hints, MaskError, SegmentSettings, Turn, Warning, cleanup, pyramid, turn, warning};

/// On one frame a hole of this share of the object may be a highlight, and is filled.
const FILLED_OF_FRAME: f64 = 0.01;
/// Over a turn highlights move: only specks are filled.
const FILLED_OF_TURN: f64 = 0.001;

/// An object's mask on one frame.
#[derive(Debug, Clone)]
pub struct Mask {
    image: GrayImage,
    statistics: MaskStatistics,
    warnings: Vec<Warning>,
}

/// Numbers about a mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MaskStatistics {
    /// Pixels of the object (at or above 128), at least 1.
    pub area_px: u64,
    /// The smallest rectangle around them.
    pub bounding_box: Rect,
    /// Connected components before the clean-up, at least 1.
    pub components: usize,
    /// Connected components that were kept.
    pub components_kept: usize,
    /// Pixels of the holes that were filled.
    pub holes_filled_px: u64,
}

impl Mask {
    /// The mask, in the size of the frame: 255 object, 0 background; with a feather also values
    /// between.
    #[must_use]
    pub fn image(&self) -> &GrayImage {
        &self.image
    }

    /// Area, bounding box and components.
    #[must_use]
    pub fn statistics(&self) -> MaskStatistics {
        self.statistics
    }

    /// What its user should check.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }
}

/// Finds the object in `frame`. The same input gives the same mask, with any number of threads.
///
/// # Errors
/// [`MaskError::FrameTooSmall`], [`MaskError::FrameTooLarge`]; hints that do not fit the frame
/// ([`MaskError::RectOutside`], [`MaskError::NoBackground`], [`MaskError::NoObject`], [`MaskError::SeedsSize`]);
/// a result without object or without background ([`MaskError::Empty`], [`MaskError::Everything`]);
/// [`MaskError::OpenCv`].
pub fn segment(
    frame: &RgbImage,
    hints: &Hints,
    settings: &SegmentSettings,
) -> Result<Mask, MaskError> {
    let size = frame.dimensions();
    check_size(size)?;
    let InitialLabels {
        mut labels,
        first,
        rect,
    } = InitialLabels::new(hints, size)?;
    pyramid::segment(frame, &mut labels, first, settings.iterations)?;
    let raw = Bitmap::new(size, labels.iter().map(|label| label.is_object()));
    drop(labels);
    finish(&raw, size, Some(hints), rect, settings, FILLED_OF_FRAME)
}

/// Finds the object in `frame` by what a turn tells, with or without hints. `turn` holds frames of the
/// same recording. The same input gives the same mask.
///
/// # Errors
/// [`MaskError::FewFrames`]; otherwise as [`segment`].
pub fn segment_turn(
    frame: &RgbImage,
    turn: &Turn,
    hints: Option<&Hints>,
    settings: &SegmentSettings,
) -> Result<Mask, MaskError> {
    let size = frame.dimensions();
    check_size(size)?;
    let labels = turn::segment(frame, turn, hints, settings.iterations)?;
    let raw = Bitmap::new(size, labels.iter().map(|label| label.is_object()));
    drop(labels);
    let rect = hints.and_then(Hints::rect);
    let rect = rect.and_then(|rect| rect.clipped_to(size.0, size.1));
    finish(&raw, size, hints, rect, settings, FILLED_OF_TURN)
}

fn finish(
    raw: &Bitmap,
    size: (u32, u32),
    hints: Option<&Hints>,
    rect: Option<Rect>,
    settings: &SegmentSettings,
    fill_to: f64,
) -> Result<Mask, MaskError> {
    let seeds = hints.and_then(Hints::seeds);
    let cleaned = cleanup::clean(raw, seeds, settings.keep_all, fill_to);
    Ok(Mask {
        image: cleanup::soften(&cleaned.mask, size, settings.feather)?,
        statistics: MaskStatistics {
            area_px: cleaned.mask.count(),
            bounding_box: cleaned.mask.bounds(),
            components: cleaned.components,
            components_kept: cleaned.kept,
            holes_filled_px: cleaned.holes.iter().map(|hole| hole.area).sum(),
        },
        warnings: warning::warnings(hints, rect, &cleaned, size),
    })
}

fn check_size((width, height): (u32, u32)) -> Result<(), MaskError> {
    if width.min(height) < MIN_SIDE {
        return Err(MaskError::FrameTooSmall { width, height });
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(MaskError::FrameTooLarge { width, height });
    }
    Ok(())
}
