//! What cuts the object out of its frame.

use image::RgbImage;
use relit_grabcut::{Hints, Mask, MaskError, SegmentSettings, check_hints, clean_cut};
use serde::{Deserialize, Serialize};

use super::MaskingError;

#[cfg(feature = "opencv")]
pub use super::opencv_grab_cut::opencv_grab_cut;
#[cfg(feature = "opencv")]
pub(super) use super::opencv_grab_cut::opencv_version;

/// What cuts the object out of its frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum MaskEngine {
    /// relit's GrabCut, by hints, by a turn, or by both.
    #[default]
    Relit,
    /// OpenCV's GrabCut on one frame by a rectangle or seeds, and then relit's clean-up: a reference. In this
    /// program only with the feature `opencv`.
    OpenCv,
}

impl MaskEngine {
    /// Whether this program was built with it.
    #[must_use]
    pub fn is_built_in(self) -> bool {
        self == Self::Relit || cfg!(feature = "opencv")
    }

    /// Says what is missing before anything is read.
    pub(super) fn check(self, by_turn: bool) -> Result<(), MaskingError> {
        match self {
            Self::Relit => Ok(()),
            Self::OpenCv if !self.is_built_in() => Err(MaskingError::WithoutOpenCv),
            Self::OpenCv if by_turn => Err(MaskingError::OpenCvKnowsNoTurn),
            Self::OpenCv => Ok(()),
        }
    }
}

/// The mask of OpenCV's cut.
pub(super) fn cut_by_opencv(
    frame: &RgbImage,
    hints: Option<&Hints>,
    settings: &SegmentSettings,
) -> Result<Mask, MaskingError> {
    let hints = hints.ok_or(MaskError::NoHints)?;
    check_hints(hints, frame.dimensions())?;
    let cut = opencv_grab_cut(frame, hints, settings.iterations)?;
    Ok(clean_cut(&cut, hints, settings)?)
}

/// The version of the OpenCV that is linked.
#[cfg(not(feature = "opencv"))]
pub(super) fn opencv_version() -> Option<String> {
    None
}

/// OpenCV's GrabCut, which this program was built without.
///
/// # Errors
/// Always [`MaskingError::WithoutOpenCv`].
#[cfg(not(feature = "opencv"))]
pub fn opencv_grab_cut(
    _: &RgbImage,
    _: &Hints,
    _: relit_grabcut::Iterations,
) -> Result<image::GrayImage, MaskingError> {
    Err(MaskingError::WithoutOpenCv)
}
