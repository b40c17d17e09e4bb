//! A mask with its figures and warnings.

use image::GrayImage;
use relit_data::geometry::Rect;

use super::Warning;
use super::bitmap::Bitmap;

/// An object's mask on one frame.
#[derive(Debug, Clone)]
pub struct Mask {
    pub(super) image: GrayImage,
    pub(super) statistics: MaskStatistics,
    pub(super) warnings: Vec<Warning>,
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
    pub(super) fn with_warning(mut self, warning: Option<Warning>) -> Self {
        self.warnings.extend(warning);
        self
    }

    /// The pixels of the object.
    pub(super) fn bitmap(&self) -> Bitmap {
        let levels = self.image.as_raw().iter();
        Bitmap::new(self.image.dimensions(), levels.map(|&level| level >= 128))
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
