//! What cuts the object out of its frame.

use clap::ValueEnum;
use image::RgbImage;
use relit_grabcut::{Hints, Mask, SegmentSettings, check_hints, clean_cut};
use serde::{Deserialize, Serialize};

use super::MaskingError;
#[cfg(feature = "opencv")]
use super::opencv_grab_cut::opencv_grab_cut;
#[cfg(feature = "opencv")]
pub(super) use super::opencv_grab_cut::opencv_version;

/// Why [`MaskEngine::OpenCv`] cuts nothing by a turn.
pub const OPENCV_KNOWS_NO_TURN: &str = "OpenCV's GrabCut sees one frame and no turn: give --rect or --seeds without --auto, or leave out --engine opencv";
const WITHOUT_OPENCV: &str = "OpenCV is not built into this relit-mask: build it with `cargo build --release -p relit-mask --features opencv`, or leave out --engine opencv";

/// What cuts the object out of its frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
#[value(rename_all = "lower")]
pub enum MaskEngine {
    /// relit's GrabCut, with hints, a turn, or both.
    #[default]
    Relit,
    /// OpenCV's GrabCut, for comparison; needs the feature `opencv`.
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
        let missing = match self {
            Self::Relit => return Ok(()),
            Self::OpenCv if !self.is_built_in() => WITHOUT_OPENCV,
            Self::OpenCv if by_turn => OPENCV_KNOWS_NO_TURN,
            Self::OpenCv => return Ok(()),
        };
        Err(MaskingError::Refused(missing.to_owned()))
    }
}

/// The mask of OpenCV's cut.
pub(super) fn cut_by_opencv(
    frame: &RgbImage,
    hints: &Hints,
    settings: &SegmentSettings,
) -> Result<Mask, MaskingError> {
    let hints = &*hints.painted(frame.dimensions())?;
    check_hints(hints, frame.dimensions())?;
    let cut = opencv_grab_cut(frame, hints)?;
    Ok(clean_cut(&cut, hints, settings)?)
}

/// The version of the OpenCV that is linked.
#[cfg(not(feature = "opencv"))]
pub(super) fn opencv_version() -> Option<String> {
    None
}

#[cfg(not(feature = "opencv"))]
fn opencv_grab_cut(_: &RgbImage, _: &Hints) -> Result<image::GrayImage, MaskingError> {
    Err(MaskingError::Refused(WITHOUT_OPENCV.to_owned()))
}
