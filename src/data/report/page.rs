//! The content of a page.

use image::RgbImage;

use crate::shard::SessionQuality;
use crate::shard::record::FrameRecord;

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
