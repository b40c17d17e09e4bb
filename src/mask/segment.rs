//! From a frame and hints to a mask.

use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;

use super::bitmap::Bitmap;
use super::initial::InitialLabels;
use super::settings::{MAX_PIXELS, MIN_SIDE};
use super::{Hints, MaskError, SegmentSettings, Turn, Warning, cleanup, pyramid, turn, warning};

/// On one frame a hole of this share of the object may be a highlight, and is filled.
const FILLED_OF_FRAME: f64 = 0.01;
/// The turn's outline has at least this share of the strength of the hints' one.
const LEAST_OF_HINTS: f32 = 0.85;
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
    fn with_warning(mut self, warning: Option<Warning>) -> Self {
        self.warnings.extend(warning);
        self
    }

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

/// Finds the object in `frame` by what a turn shows, with or without hints. `turn` holds frames of the
/// same recording. The same input gives the same mask.
///
/// With hints there is a guard against a turn that misleads: if its mask has an outline along which less
/// moves differently than along that of the hints alone, or if there are too few frames, the hints alone
/// decide, and a warning says so.
///
/// # Errors
/// [`MaskError::FewFrames`] without hints; otherwise as [`segment`].
pub fn segment_turn(
    frame: &RgbImage,
    turn: &Turn,
    hints: Option<&Hints>,
    settings: &SegmentSettings,
) -> Result<Mask, MaskError> {
    let size = frame.dimensions();
    check_size(size)?;
    let by_turn = turn::segment(frame, turn, hints, settings.iterations);
    let Some(hints) = hints else {
        let by_turn = by_turn?;
        let still = (!by_turn.moves()).then_some(Warning::NothingMoves);
        let mask = finish(&by_turn.object, size, None, None, settings, FILLED_OF_TURN)?;
        return Ok(mask.with_warning(still));
    };
    let by_hints = segment(frame, hints, settings);
    let by_turn = match by_turn {
        Ok(by_turn) => by_turn,
        Err(error) => {
            let dropped = Warning::TurnDropped {
                why: error.to_string(),
            };
            return by_hints.map(|mask| mask.with_warning(Some(dropped)));
        }
    };
    if let Ok(by_hints) = by_hints {
        let object = by_hints.image.as_raw().iter().map(|&level| level >= 128);
        let object = Bitmap::new(size, object);
        let width = size.0 as usize;
        let (of_turn, of_hints) = (
            by_turn.outline(&by_turn.object, width),
            by_turn.outline(&object, width),
        );
        if of_turn < LEAST_OF_HINTS * of_hints {
            let why = format!(
                "its outline follows what moves less well ({of_turn:.2}) than that of the hints alone ({of_hints:.2})"
            );
            return Ok(by_hints.with_warning(Some(Warning::TurnDropped { why })));
        }
    }
    let still = (!by_turn.moves()).then_some(Warning::NothingMoves);
    let rect = hints
        .rect()
        .and_then(|rect| rect.clipped_to(size.0, size.1));
    let mask = finish(
        &by_turn.object,
        size,
        Some(hints),
        rect,
        settings,
        FILLED_OF_TURN,
    )?;
    Ok(mask.with_warning(still))
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
