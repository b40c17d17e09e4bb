//! What is found about a mask.

use std::path::PathBuf;

use relit_grabcut::ShapeCheck;
use serde::Serialize;

use super::drift::DriftCheck;
use super::verdict::MaskVerdict;

/// Everything that was found about a mask.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[non_exhaustive]
pub struct MaskReport {
    /// Whether it fits.
    pub verdict: MaskVerdict,
    /// Why not, one sentence each; empty if it fits.
    pub reasons: Vec<String>,
    /// Where the object is over the turn; none if it was found in no frame.
    pub drift: Option<DriftCheck>,
    /// The mask's shape; none if hardly anything moves in the video.
    pub shape: Option<ShapeCheck>,
}

/// A report that was written.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub struct CheckOutput {
    /// The recording's id.
    pub recording: String,
    /// The report.
    pub report: MaskReport,
    /// The page: `NAME-check.html` beside the mask, or `NAME-on-RECORDING-check.html` where the mask is not the
    /// recording's own.
    pub page: PathBuf,
}
