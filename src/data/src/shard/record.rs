//! The record of one frame, which is both a sample's JSON member and a row of the table.

use serde::{Deserialize, Serialize};

use crate::geometry::Rect;
use crate::image_stats::Measures;
use crate::spec_net_gate;

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
    /// Standard deviation of `shift_px`, source pixels, where the frame could not be registered and the frames around it
    /// tell the shift; null where it was measured or is not known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shift_interpolated_sd_px: Option<f64>,
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
    /// How much less sharp the frame is than the frames around it, as the base-2 logarithm of the ratio,
    /// where it is a blur that moving light cannot explain; else null.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blur: Option<f64>,
}

impl FrameRecord {
    /// The record of sample `index` of a session, whose image shows the part `crop` of its source frame at the source's
    /// own size, with what was measured of it. `gate`: the saturated fraction above which Spec-Net should run.
    ///
    /// The source frame is the one of the same number, at time 0; angle, shifts and findings are not known.
    pub fn new(
        session: &str,
        object: &str,
        index: u32,
        crop: Rect,
        measures: &Measures,
        gate: f64,
    ) -> Self {
        let saturated_fraction = measures.saturated_fraction();
        Self {
            session: session.to_owned(),
            object: object.to_owned(),
            index,
            source_frame: u64::from(index),
            t_us: 0,
            angle_deg: None,
            duplicate: false,
            crop,
            size: [crop.w, crop.h],
            shift_px: None,
            shift_applied: false,
            align_confidence: None,
            shift_interpolated_sd_px: None,
            mask_px: measures.mask_px,
            saturated_px: measures.saturated_px,
            saturated_fraction,
            saturated_any_px: measures.saturated_any_px,
            spec_net: spec_net_gate::opens(saturated_fraction, gate),
            mean_rgb: measures.mean_rgb,
            sharpness: measures.sharpness,
            exposure_step: None,
            identical_to: None,
            blur: None,
        }
    }
}

#[cfg(test)]
pub(super) use tests::record;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spec_net_gate::SPEC_NET_GATE;

    /// A record without anything remarkable.
    pub(in crate::shard) fn record(index: u32) -> FrameRecord {
        let measures = Measures {
            mask_px: 40,
            saturated_px: 2,
            saturated_any_px: 4,
            mean_rgb: [90.0; 3],
            sharpness: 12.5,
        };
        let crop = Rect::new(0, 0, 8, 8);
        FrameRecord {
            t_us: i64::from(index) * 33_333,
            ..FrameRecord::new("s", "o", index, crop, &measures, SPEC_NET_GATE)
        }
    }

    #[test]
    fn an_interpolated_shift_is_written_only_where_there_is_one() {
        let measured = serde_json::to_string(&record(3)).unwrap();
        assert!(!measured.contains("interpolated"), "{measured}");
        let placed = FrameRecord {
            shift_px: Some([0.5, -0.25]),
            shift_applied: true,
            align_confidence: Some(0.1),
            shift_interpolated_sd_px: Some(0.3),
            ..record(3)
        };
        let text = serde_json::to_string(&placed).unwrap();
        assert!(text.contains(r#""shift_interpolated_sd_px":0.3"#), "{text}");
        assert_eq!(serde_json::from_str::<FrameRecord>(&text).unwrap(), placed);
    }
}
