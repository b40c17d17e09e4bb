//! The record of one frame: what a sample's JSON member and a row of the table hold.

use serde::{Deserialize, Serialize};

use crate::geometry::Rect;

/// What is known of one sample, as it stands in `<session>/<kkkk>.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameRecord {
    /// The session's id; the folder part of the sample's key.
    pub session: String,
    /// The object's name.
    pub object: String,
    /// Which sample of the turn this is, `0..frames` (0..=1499 by default).
    pub index: u32,
    /// Position of the source frame in the video, 0-based, in order of presentation.
    pub source_frame: u64,
    /// The source frame's time stamp, microseconds: the driver's monotonic clock where the
    /// session has it, else the video's own time stamp.
    pub t_us: i64,
    /// Angle of the table, degrees; null where there is no table.
    pub angle_deg: Option<f64>,
    /// True where another sample of the session shows the same source frame and is not flagged: of
    /// all samples of one source frame, exactly one is not a duplicate. Where frames were dropped, it
    /// is the one whose place in the turn is the frame's own.
    pub duplicate: bool,
    /// The part of the source frame that the image shows, source pixels. May reach beyond the
    /// frame, where the image is 0.
    pub crop: Rect,
    /// Width and height of image and mask, pixels.
    pub size: [u32; 2],
    /// Measured shift of the object against the mask's frame, [right, down], source pixels; null
    /// where it was not measured.
    pub shift_px: Option<[f64; 2]>,
    /// True where `shift_px` was corrected in the image.
    pub shift_applied: bool,
    /// Source pixels under the mask.
    pub mask_px: u64,
    /// Source pixels under the mask with all three channels at or above the saturation level.
    pub saturated_px: u64,
    /// `saturated_px / mask_px`, 0..=1.
    pub saturated_fraction: f64,
    /// Source pixels under the mask with any channel at or above the saturation level.
    pub saturated_any_px: u64,
    /// The gate: `saturated_fraction` is above the gate (5 %), so Spec-Net is to run.
    pub spec_net: bool,
    /// Mean 8-bit sRGB value of the source pixels under the mask, red, green, blue, 0..=255.
    pub mean_rgb: [f64; 3],
    /// Variance of the Laplacian of luma over the source pixels under the mask whose four
    /// neighbours are under the mask too. Larger is sharper.
    pub sharpness: f64,
}
