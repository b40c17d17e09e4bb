//! The HTML page that shows one extracted session: what came out, what is wrong with it, and how
//! the light went round the object.
//!
//! One file that a browser opens from a disk without a network: the frames are `data:` URIs, the
//! plots are inline SVG, and there is no script. The same input gives the same bytes.
//!
//! This room knows the frame's record ([`crate::shard::record`]) and small RGB images. It knows
//! nothing of videos, masks, shards or where the page will lie; [`render`] returns text.

mod axis;
mod contact;
mod html;
mod plot;
mod sections;
mod turn;

use image::RgbImage;

use crate::shard::record::FrameRecord;
use turn::Turn;

/// Longest side of a thumbnail, pixels.
pub const THUMBNAIL_SIDE: u32 = 256;

/// Largest sharpness that is taken: far above what a Laplacian of 8-bit luma can reach.
const SHARPEST: f64 = 1e9;

/// Largest angle that is taken, degrees: above it an angle has no useful digits left.
const FARTHEST: f64 = 1e9;

/// One frame of the contact sheet.
#[derive(Debug, Clone)]
pub struct Thumbnail {
    /// The sample that it shows: a record of the page has this index.
    pub index: u32,
    /// The masked frame, 8-bit sRGB, 1..=[`THUMBNAIL_SIDE`] pixels a side.
    pub image: RgbImage,
}

/// All that stands on the page of one session.
#[derive(Debug, Clone, Copy)]
pub struct Page<'a> {
    /// The session's records, at least one, by ascending index.
    pub records: &'a [FrameRecord],
    /// The contact sheet, in the order in which it is shown: 24 over the turn fill the rows.
    pub thumbnails: &'a [Thumbnail],
    /// How the session was extracted: name and value, in the order in which they are shown.
    pub settings: &'a [(String, String)],
    /// What is known of the source and the run: name and value, as the settings.
    pub facts: &'a [(String, String)],
    /// What a person should look at before the data is used, one sentence each.
    pub warnings: &'a [String],
    /// Saturated fraction above which Spec-Net runs, 0..=1.
    pub gate: f64,
    /// 8-bit value from which a channel counts as saturated.
    pub saturation_level: u8,
}

/// Why a page cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// There is nothing to show.
    #[error("the report has no records to show: extract at least one frame first")]
    Empty,
    /// The records do not ascend.
    #[error(
        "the report's record with index {index} stands after index {before}: \
         give each record once, by ascending index"
    )]
    Order {
        /// Index of the record that is out of place.
        index: u32,
        /// Index of the record before it.
        before: u32,
    },
    /// A record is another session's.
    #[error(
        "the report of session {expected:?} was given record {index} of session {found:?}: \
         make one report a session"
    )]
    Session {
        /// Index of the stray record.
        index: u32,
        /// The session of the first record.
        expected: String,
        /// The session of the stray record.
        found: String,
    },
    /// A figure cannot be plotted.
    #[error(
        "the report cannot plot {field} = {value} of record {index}, which should lie in {range}: \
         extract the session again"
    )]
    Value {
        /// Index of the record.
        index: u32,
        /// The record's field.
        field: &'static str,
        /// What it holds.
        value: f64,
        /// What it may hold.
        range: &'static str,
    },
    /// The gate is no fraction.
    #[error("the report's gate is {0}, which is not a fraction: give a number in 0..=1")]
    Gate(f64),
    /// A thumbnail belongs to no record.
    #[error("the report's thumbnail {0} has no record: give thumbnails of samples that exist")]
    Stray(u32),
    /// A thumbnail has no pixels or too many.
    #[error(
        "the report's thumbnail {index} is {width} x {height} pixels: \
         scale it to between 1 and {THUMBNAIL_SIDE} pixels a side"
    )]
    Size {
        /// Index of the sample.
        index: u32,
        /// Width, pixels.
        width: u32,
        /// Height, pixels.
        height: u32,
    },
    /// A thumbnail could not be encoded.
    #[error("the report's thumbnail {index} could not be encoded: check the frame it came from")]
    Encode {
        /// Index of the sample.
        index: u32,
        /// What the encoder said.
        source: image::ImageError,
    },
}

/// The page as one HTML document.
///
/// About 250 kB for 1500 records and 24 thumbnails of 256 pixels; it grows with the thumbnails,
/// the warnings and the tables, and hardly with the number of records.
///
/// # Errors
///
/// [`Error::Empty`], [`Error::Order`] and [`Error::Session`] where the records are not those of
/// one session in order; [`Error::Value`] and [`Error::Gate`] where a number is not finite or out
/// of range; [`Error::Stray`], [`Error::Size`] and [`Error::Encode`] where a thumbnail does not
/// fit.
pub fn render(page: &Page<'_>) -> Result<String, Error> {
    check(page)?;
    let turn = Turn::of(page.records);
    let contact = contact::sheet(page, &turn)?;
    Ok(sections::document(page, &turn, &contact))
}

fn check(page: &Page<'_>) -> Result<(), Error> {
    let first = page.records.first().ok_or(Error::Empty)?;
    if !(0.0..=1.0).contains(&page.gate) {
        return Err(Error::Gate(page.gate));
    }
    for pair in page.records.windows(2) {
        if let [before, record] = pair
            && record.index <= before.index
        {
            return Err(Error::Order {
                index: record.index,
                before: before.index,
            });
        }
    }
    for record in page.records {
        if record.session != first.session {
            return Err(Error::Session {
                index: record.index,
                expected: first.session.clone(),
                found: record.session.clone(),
            });
        }
        check_values(record)?;
    }
    Ok(())
}

fn check_values(record: &FrameRecord) -> Result<(), Error> {
    let within = |field, value: f64, low: f64, high: f64, range| {
        // False for NaN, which a comparison with < would let pass.
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(Error::Value {
            index: record.index,
            field,
            value,
            range,
        })
    };
    within(
        "saturated_fraction",
        record.saturated_fraction,
        0.0,
        1.0,
        "0..=1",
    )?;
    within(
        "saturated_any_px / mask_px",
        any_fraction(record),
        0.0,
        1.0,
        "0..=1",
    )?;
    within("sharpness", record.sharpness, 0.0, SHARPEST, "0..=1e9")?;
    for mean in record.mean_rgb {
        within("mean_rgb", mean, 0.0, 255.0, "0..=255")?;
    }
    if let Some(angle) = record.angle_deg {
        within("angle_deg", angle, -FARTHEST, FARTHEST, "-1e9..=1e9")?;
    }
    Ok(())
}

/// Part of the mask in which any channel is saturated; 0 for an empty mask.
#[expect(
    clippy::cast_precision_loss,
    reason = "pixel counts stay far below 2^52"
)]
fn any_fraction(record: &FrameRecord) -> f64 {
    if record.mask_px == 0 {
        return 0.0;
    }
    record.saturated_any_px as f64 / record.mask_px as f64
}
