//! The settings of a segmentation, and the limits on its input.

use serde::{Deserialize, Serialize};

/// The smallest width and height of a frame, pixels.
pub const MIN_SIDE: u32 = 16;

/// The most pixels of a frame, 8192 x 4320: GrabCut's graph needs about 250 bytes for each.
pub const MAX_PIXELS: u64 = 8192 * 4320;

/// A setting that is out of range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SettingsFault {
    /// A number of iterations.
    #[error("{0} iterations are out of range: give 1 to {max}", max = Iterations::MAX)]
    Iterations(u32),
    /// A feather.
    #[error("a feather of {0} pixels is out of range: give 0 to {max}", max = Feather::MAX)]
    Feather(u32),
}

/// Number of GrabCut's iterations, 1..=[`Iterations::MAX`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Iterations(u32);

impl Iterations {
    /// The largest number, which bounds the time that a typing error can cost.
    pub const MAX: u32 = 100;

    /// Checks the number.
    ///
    /// # Errors
    /// [`SettingsFault::Iterations`] outside 1..=[`Self::MAX`].
    pub fn new(count: u32) -> Result<Self, SettingsFault> {
        if (1..=Self::MAX).contains(&count) {
            Ok(Self(count))
        } else {
            Err(SettingsFault::Iterations(count))
        }
    }

    /// The number.
    #[must_use]
    pub fn get(self) -> u32 {
        self.0
    }
}

impl Default for Iterations {
    fn default() -> Self {
        Self(5)
    }
}

/// Width of the mask's soft edge, pixels, 0..=[`Feather::MAX`]: the distance over which the mask rises
/// from 10 % to 90 % at a straight edge. 0 is a hard edge.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Feather(u32);

impl Feather {
    /// The largest width, pixels.
    pub const MAX: u32 = 100;

    /// Checks the width.
    ///
    /// # Errors
    /// [`SettingsFault::Feather`] above [`Self::MAX`].
    pub fn new(px: u32) -> Result<Self, SettingsFault> {
        if px <= Self::MAX {
            Ok(Self(px))
        } else {
            Err(SettingsFault::Feather(px))
        }
    }

    /// The width, pixels.
    #[must_use]
    pub fn px(self) -> u32 {
        self.0
    }
}

/// How a mask is made from an image and hints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentSettings {
    /// Number of GrabCut's iterations.
    pub iterations: Iterations,
    /// Keep every connected component, not only the largest.
    pub keep_all: bool,
    /// Width of the soft edge.
    pub feather: Feather,
    /// Whether the share of the object in each pixel of the edge is wanted beside the mask.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub alpha: bool,
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
    /// All pixels at the frame's own size, as GrabCut was published: slow, and needs much memory. What
    /// coarse to fine is measured against.
    Whole,
}

impl Effort {
    /// The frame is halved until it has at most so many pixels.
    pub(super) fn coarsest_px(self) -> usize {
        match self {
            Self::Draft | Self::Fine => 200_000,
            Self::Whole => usize::MAX,
        }
    }

    /// Whether a frame is cut up to its own size.
    #[must_use]
    pub fn covers(self, width: u32, height: u32) -> bool {
        width as usize * height as usize <= self.finest_px()
    }

    /// The edge is decided again up to so many pixels.
    pub(super) fn finest_px(self) -> usize {
        match self {
            Self::Draft => 1_000_000,
            Self::Fine | Self::Whole => usize::MAX,
        }
    }
}

impl TryFrom<u32> for Iterations {
    type Error = SettingsFault;

    fn try_from(count: u32) -> Result<Self, SettingsFault> {
        Self::new(count)
    }
}

impl From<Iterations> for u32 {
    fn from(iterations: Iterations) -> Self {
        iterations.0
    }
}

impl TryFrom<u32> for Feather {
    type Error = SettingsFault;

    fn try_from(px: u32) -> Result<Self, SettingsFault> {
        Self::new(px)
    }
}

impl From<Feather> for u32 {
    fn from(feather: Feather) -> Self {
        feather.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_iterations_and_too_many_are_refused() {
        assert!(Iterations::new(0).is_err());
        assert!(Iterations::new(Iterations::MAX + 1).is_err());
        assert_eq!(Iterations::new(7).unwrap().get(), 7);
        assert!(serde_json::from_str::<Iterations>("0").is_err());
    }

    #[test]
    fn a_feather_above_the_limit_is_refused() {
        assert!(Feather::new(Feather::MAX + 1).is_err());
        assert_eq!(Feather::new(0).unwrap(), Feather::default());
    }
}
