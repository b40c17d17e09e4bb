//! The record of one frame, which is both a sample's JSON member and a row of the table.

use serde::{Deserialize, Serialize};

use crate::geometry::Rect;

/// The record of one sample, as it is in `<session>/<kkkk>.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameRecord {
    /// The session's id; the folder part of the sample's key.
    pub session: String,
    /// The object's name.
    pub object: String,
    /// Which sample of the turn this is, `0..frames` (0..=1499 by default).
    pub index: u32,
    /// Position of the source frame in the video, 0-based, in presentation order.
    pub source_frame: u64,
    /// The source frame's time stamp, microseconds: from the driver's monotonic clock if the session
    /// has it, else from the video.
    pub t_us: i64,
    /// Angle of the table, degrees; null without a table.
    pub angle_deg: Option<f64>,
    /// True if another sample of the session shows the same source frame. Of all samples of a source
    /// frame exactly one is not flagged: the one whose position in the turn is nearest to the
    /// frame's.
    pub duplicate: bool,
    /// The part of the source frame that the image shows, source pixels. It may extend beyond the
    /// frame, where the image is 0.
    pub crop: Rect,
    /// Width and height of image and mask, pixels.
    pub size: [u32; 2],
    /// Measured shift of the object against the mask's frame, [right, down], source pixels; null if
    /// it was not measured.
    pub shift_px: Option<[f64; 2]>,
    /// True if `shift_px` was corrected in the image.
    pub shift_applied: bool,
    /// How well the frame's structure fits the object's, 0..=1; null if shifts were not measured. With a
    /// value and without `shift_px`, the frame could not be registered.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub align_confidence: Option<f64>,
    /// Source pixels under the mask.
    pub mask_px: u64,
    /// Source pixels under the mask with all three channels at or above the saturation level.
    pub saturated_px: u64,
    /// `saturated_px / mask_px`, 0..=1.
    pub saturated_fraction: f64,
    /// Source pixels under the mask with any channel at or above the saturation level.
    pub saturated_any_px: u64,
    /// True if `saturated_fraction` is above the gate (5 % by default): Spec-Net should run.
    pub spec_net: bool,
    /// Mean 8-bit sRGB value of the source pixels under the mask, red, green, blue, 0..=255.
    pub mean_rgb: [f64; 3],
    /// Variance of the Laplacian of luma over the source pixels under the mask whose four
    /// neighbours are under the mask too. Larger is sharper.
    pub sharpness: f64,
    /// The change of exposure against the sample before, stops, where it is a step that moving light
    /// cannot explain; else null.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exposure_step: Option<f64>,
    /// The nearest earlier source frame whose picture is the same, pixel for pixel: the camera delivered it
    /// twice; null if there is none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identical_to: Option<u64>,
}
