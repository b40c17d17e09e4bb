//! The HTML page that shows one extracted session: the result, its warnings, and how the light moved around the object.
//!
//! One file that a browser opens from disk without a network: the frames are `data:` URIs, the plots
//! are inline SVG, and it has no script. The same input gives the same bytes.
//!
//! This module knows the frame's record ([`crate::shard::record`]) and small RGB images. It knows nothing of videos,
//! masks, shards or files: [`render`] returns text.

mod contact;
mod html;
mod plot;
mod sections;
mod text;
mod turn;

use image::{ImageError, RgbImage};

use crate::shard::SessionQuality;
use crate::shard::record::FrameRecord;
use turn::Turn;

/// Longest side of a thumbnail, pixels.
pub const THUMBNAIL_SIDE: u32 = 256;

/// The content of the page of one session.
#[derive(Debug, Clone, Copy)]
pub struct Page<'a> {
    /// The session's records, at least one, by ascending index.
    pub records: &'a [FrameRecord],
    /// The contact sheet, in display order: the index of a sample, which is one of the records, and its masked frame, 8-bit
    /// sRGB, at most [`THUMBNAIL_SIDE`] pixels a side. 24 thumbnails fill the rows.
    pub thumbnails: &'a [(u32, RgbImage)],
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
/// [`ImageError`] if a thumbnail cannot be encoded.
pub fn render(page: &Page<'_>) -> Result<String, ImageError> {
    let turn = Turn::from_records(page.records);
    let contact = contact::sheet(page, &turn)?;
    Ok(sections::document(page, &turn, &contact))
}
