//! Which pixels of a frame are the object: hints of a person, OpenCV's GrabCut, clean-up.
//!
//! Camera and object ride on one turntable, so one mask serves all frames of a turn. [`segment`]
//! makes it from one image; what is written beside a mask is a [`MaskRecord`]. Knows nothing of
//! videos, sessions and shards, nor of how masks are used.
//!
//! With a rectangle its outside is background for sure and its inside probably object; seeds
//! overrule it. Where there are only seeds, the colours of the marked pixels decide first; with no
//! background marked, unmarked pixels start as probable background. Of the cut the largest 8-connected part is kept, and holes, which are background that does not reach
//! the border through 4-connected pixels, are filled, except those in which seeds mark background.

mod bitmap;
mod cleanup;
mod cut;
mod encode;
mod error;
mod hints;
mod preview;
mod record;
mod settings;
mod warning;

use image::{GrayImage, RgbImage};

use relit_data::geometry::Rect;

pub use encode::{grey_png, rgb_png};
pub use error::{Error, SeedsFault};
pub use hints::{Hints, Mark, Seeds};
pub use preview::preview;
pub use record::{
    MASK_SCHEMA, MaskRecord, RecordFault, RecordedHints, RecordedResult, Software, Source,
};
pub use settings::{Feather, Iterations, Settings};
pub use warning::{Side, Warning};

/// The least width and height of a frame, pixels.
pub const MIN_SIDE: u32 = 16;

/// The most pixels of a frame, 8192 x 4320: GrabCut's graph takes about 250 bytes for each.
pub const MAX_PIXELS: u64 = 8192 * 4320;

/// An object's mask on one frame.
#[derive(Debug, Clone)]
pub struct Mask {
    image: GrayImage,
    figures: Figures,
    warnings: Vec<Warning>,
}

/// A mask in numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Figures {
    /// Pixels of the object: at or above 128, at least 1.
    pub area_px: u64,
    /// The smallest rectangle around them.
    pub bounding_box: Rect,
    /// Parts of the cut before the clean-up, at least 1.
    pub components: usize,
    /// Parts that were kept.
    pub components_kept: usize,
    /// Pixels of the holes that were filled.
    pub holes_filled_px: u64,
}

impl Mask {
    /// The mask, as large as the frame: 255 object, 0 background; with a feather also between.
    #[must_use]
    pub fn image(&self) -> &GrayImage {
        &self.image
    }

    /// Area and parts.
    #[must_use]
    pub fn figures(&self) -> Figures {
        self.figures
    }

    /// What its user has to look at.
    #[must_use]
    pub fn warnings(&self) -> &[Warning] {
        &self.warnings
    }
}

/// Finds the object on `frame`. The same input gives the same mask, with any number of threads.
///
/// # Errors
/// [`Error::FrameTooSmall`], [`Error::FrameTooLarge`]; hints that do not fit the frame
/// ([`Error::RectOutside`], [`Error::NoBackground`], [`Error::NoObject`], [`Error::SeedsSize`]);
/// a cut that leaves one side empty ([`Error::Empty`], [`Error::Everything`]);
/// [`Error::OpenCv`].
pub fn segment(frame: &RgbImage, hints: &Hints, settings: &Settings) -> Result<Mask, Error> {
    let size = frame.dimensions();
    check_size(size)?;
    let start = cut::Start::new(hints, size)?;
    let rect = start.rect;
    let raw = cut::cut(frame, start, settings.iterations)?;
    let cleaned = cleanup::clean(&raw, hints.seeds(), settings.keep_all);
    Ok(Mask {
        image: cleanup::soften(&cleaned.mask, size, settings.feather)?,
        figures: Figures {
            area_px: cleaned.mask.count(),
            bounding_box: cleaned.mask.bounds(),
            components: cleaned.components,
            components_kept: cleaned.kept,
            holes_filled_px: cleaned.holes.iter().map(|hole| hole.area).sum(),
        },
        warnings: warning::of(hints, rect, &cleaned, size),
    })
}

fn check_size((width, height): (u32, u32)) -> Result<(), Error> {
    if width.min(height) < MIN_SIDE {
        return Err(Error::FrameTooSmall { width, height });
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(Error::FrameTooLarge { width, height });
    }
    Ok(())
}
