//! The HTML page that shows one extracted session: the result, its warnings, and how the light moved around the object.
//!
//! One file that a browser opens from disk without a network: the frames are `data:` URIs, the plots
//! are inline SVG, and there is no script. The same input gives the same bytes.
//!
//! This module knows the frame's record ([`crate::shard::record`]) and small RGB images. It knows nothing of videos,
//! masks, shards or files: [`render`] returns text.

mod axis;
mod contact;
mod html;
mod plot;
mod sections;
mod turn;

use image::RgbImage;

use crate::image_stats::fraction;
use crate::shard::SessionQuality;
use crate::shard::record::FrameRecord;
use turn::Turn;

/// Largest valid sharpness, far above what a Laplacian of 8-bit luma can reach.
const MAX_SHARPNESS: f64 = 1e9;

/// Largest valid angle, degrees: a larger one has no useful digits left.
const MAX_ANGLE: f64 = 1e9;

/// Why a page cannot be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the report cannot be made: {0}")]
pub struct ReportError(String);

/// Longest side of a thumbnail, pixels.
pub const THUMBNAIL_SIDE: u32 = 256;

/// One frame of the contact sheet.
#[derive(Debug, Clone)]
pub struct Thumbnail {
    /// Index of the sample that it shows, which is one of the page's records.
    pub index: u32,
    /// The masked frame, 8-bit sRGB, 1..=[`THUMBNAIL_SIDE`] pixels a side.
    pub image: RgbImage,
}

/// The content of the page of one session.
#[derive(Debug, Clone, Copy)]
pub struct Page<'a> {
    /// The session's records, at least one, by ascending index.
    pub records: &'a [FrameRecord],
    /// The contact sheet, in display order; 24 thumbnails fill the rows.
    pub thumbnails: &'a [Thumbnail],
    /// How the session was extracted: name and value, in display order.
    pub settings: &'a [(String, String)],
    /// Facts about the source and the run: name and value, in display order.
    pub facts: &'a [(String, String)],
    /// What a person should check before using the data, one sentence each.
    pub warnings: &'a [String],
    /// The session's figures summed, with a verdict, if they are known.
    pub quality: Option<&'a SessionQuality>,
    /// Saturated fraction above which Spec-Net runs, 0..=1.
    pub gate: f64,
    /// 8-bit value from which a channel counts as saturated.
    pub saturation_level: u8,
}

/// The page as one HTML document.
///
/// About 250 kB for 1500 records and 24 thumbnails of 256 pixels. The size depends on the thumbnails,
/// the warnings and the tables, and hardly on the number of records.
///
/// # Errors
/// [`ReportError`] if the records are not those of one session in order, a number is not finite or out of range, or a
/// thumbnail does not fit.
pub fn render(page: &Page<'_>) -> Result<String, ReportError> {
    check(page).map_err(ReportError)?;
    let turn = Turn::of(page.records);
    let contact = contact::sheet(page, &turn).map_err(ReportError)?;
    Ok(sections::document(page, &turn, &contact))
}

fn check(page: &Page<'_>) -> Result<(), String> {
    if page.records.is_empty() {
        return Err("it has no records to show".to_owned());
    }
    if !(0.0..=1.0).contains(&page.gate) {
        return Err(format!("its gate is {}, which is no fraction", page.gate));
    }
    for pair in page.records.windows(2) {
        let [before, record] = [&pair[0], &pair[1]];
        if record.index <= before.index || record.session != before.session {
            return Err(format!(
                "record {} of session {} follows record {} of session {}",
                record.index, record.session, before.index, before.session
            ));
        }
    }
    page.records.iter().try_for_each(check_values)
}

fn check_values(record: &FrameRecord) -> Result<(), String> {
    let any = fraction(record.saturated_any_px, record.mask_px);
    let [r, g, b] = record.mean_rgb;
    let values = [
        ("saturated_fraction", record.saturated_fraction, 0.0..=1.0),
        ("saturated_any_px / mask_px", any, 0.0..=1.0),
        ("sharpness", record.sharpness, 0.0..=MAX_SHARPNESS),
        ("mean_rgb", r, 0.0..=255.0),
        ("mean_rgb", g, 0.0..=255.0),
        ("mean_rgb", b, 0.0..=255.0),
        (
            "angle_deg",
            record.angle_deg.unwrap_or_default(),
            -MAX_ANGLE..=MAX_ANGLE,
        ),
    ];
    // A range contains no NaN, which a comparison with < would accept.
    match values
        .iter()
        .find(|(_, value, range)| !range.contains(value))
    {
        Some((field, value, _)) => Err(format!("{field} of record {} is {value}", record.index)),
        None => Ok(()),
    }
}
