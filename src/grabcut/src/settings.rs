//! The settings of a segmentation, and the limits on its input.

use serde::{Deserialize, Serialize};

/// The smallest width and height of a frame, pixels.
pub const MIN_SIDE: u32 = 16;

/// The most pixels of a frame, 8192 x 4320: GrabCut's graph needs about 250 bytes for each.
pub const MAX_PIXELS: u64 = 8192 * 4320;

/// How a mask is made from an image and hints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentSettings {
    /// Keep every connected component, not only the largest.
    pub keep_all: bool,
}

/// How much work a cut is worth.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Effort {
    /// Coarse to fine up to about a million pixels; an edge in a larger frame is blocky. For showing a
    /// result while it is worked on.
    Draft,
    /// Coarse to fine, up to the frame's own size.
    #[default]
    Fine,
}

impl Effort {
    /// Whether the edge of a frame of so many pixels is decided again at its own size.
    pub fn covers(self, pixels: usize) -> bool {
        self == Self::Fine || pixels <= 1_000_000
    }
}
