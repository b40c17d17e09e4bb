//! The HTML pages that show one extracted session ([`render`]: the result, its warnings, and how the light
//! moved around the object) and a data set ([`render_overview`]).
//!
//! One file that a browser opens from disk without a network: the frames are `data:` URIs, the plots
//! are inline SVG, and there is no script. The same input gives the same bytes.
//!
//! This module knows the frame's record ([`crate::shard::record`]), sums of records
//! ([`Overview`](crate::shard::Overview)) and small RGB images. It knows nothing of videos, masks, shards or
//! files: the functions return text.

mod axis;
mod contact;
mod error;
mod html;
mod overview;
mod page;
mod plot;
mod sections;
mod turn;

pub use error::ReportError;
pub use overview::render_overview;
pub use page::{Page, THUMBNAIL_SIDE, Thumbnail};

use crate::image_stats::fraction;
use crate::shard::record::FrameRecord;
use turn::Turn;

/// Largest valid sharpness, far above what a Laplacian of 8-bit luma can reach.
const MAX_SHARPNESS: f64 = 1e9;

/// Largest valid angle, degrees: a larger one has no useful digits left.
const MAX_ANGLE: f64 = 1e9;

/// The page as one HTML document.
///
/// About 250 kB for 1500 records and 24 thumbnails of 256 pixels. The size depends on the thumbnails,
/// the warnings and the tables, and hardly on the number of records.
///
/// # Errors
///
/// [`ReportError::Empty`], [`ReportError::Order`] and [`ReportError::Session`] if the records are not those of one
/// session in order; [`ReportError::Value`] and [`ReportError::Gate`] if a number is not finite or out of range;
/// [`ReportError::UnknownSample`], [`ReportError::Size`] and [`ReportError::Encode`] if a thumbnail does not fit.
pub fn render(page: &Page<'_>) -> Result<String, ReportError> {
    check(page)?;
    let turn = Turn::of(page.records);
    let contact = contact::sheet(page, &turn)?;
    Ok(sections::document(page, &turn, &contact))
}

fn check(page: &Page<'_>) -> Result<(), ReportError> {
    let first = page.records.first().ok_or(ReportError::Empty)?;
    if !(0.0..=1.0).contains(&page.gate) {
        return Err(ReportError::Gate(page.gate));
    }
    for pair in page.records.windows(2) {
        if let [before, record] = pair
            && record.index <= before.index
        {
            return Err(ReportError::Order {
                index: record.index,
                before: before.index,
            });
        }
    }
    for record in page.records {
        if record.session != first.session {
            return Err(ReportError::Session {
                index: record.index,
                expected: first.session.clone(),
                found: record.session.clone(),
            });
        }
        check_values(record)?;
    }
    Ok(())
}

fn check_values(record: &FrameRecord) -> Result<(), ReportError> {
    let within = |field, value: f64, low: f64, high: f64, range| {
        // False for NaN, which a comparison with < would accept.
        if (low..=high).contains(&value) {
            return Ok(());
        }
        Err(ReportError::Value {
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
        fraction(record.saturated_any_px, record.mask_px),
        0.0,
        1.0,
        "0..=1",
    )?;
    within("sharpness", record.sharpness, 0.0, MAX_SHARPNESS, "0..=1e9")?;
    for mean in record.mean_rgb {
        within("mean_rgb", mean, 0.0, 255.0, "0..=255")?;
    }
    if let Some(angle) = record.angle_deg {
        within("angle_deg", angle, -MAX_ANGLE, MAX_ANGLE, "-1e9..=1e9")?;
    }
    Ok(())
}
