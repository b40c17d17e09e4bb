//! The errors of making a page.

use super::page::THUMBNAIL_SIDE;

/// Why a page cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// There are no records.
    #[error("the report has no records to show: extract at least one frame first")]
    Empty,
    /// The records are not sorted by index.
    #[error(
        "the report's record with index {index} follows index {before}: \
         give each record once, by ascending index"
    )]
    Order {
        /// Index of the record that is out of place.
        index: u32,
        /// Index of the record before it.
        before: u32,
    },
    /// A record belongs to another session.
    #[error(
        "the report of session {expected:?} was given record {index} of session {found:?}: \
         make one report per session"
    )]
    Session {
        /// Index of the record.
        index: u32,
        /// The session of the first record.
        expected: String,
        /// The session of this record.
        found: String,
    },
    /// A value is not finite or out of range.
    #[error(
        "the report cannot plot {field} = {value} of record {index}, which should lie in {range}: \
         extract the session again"
    )]
    Value {
        /// Index of the record.
        index: u32,
        /// The record's field.
        field: &'static str,
        /// Its value.
        value: f64,
        /// Its valid range.
        range: &'static str,
    },
    /// The gate is not a fraction.
    #[error("the report's gate is {0}, which is not a fraction: give a number in 0..=1")]
    Gate(f64),
    /// A thumbnail of a sample that has no record.
    #[error("the report's thumbnail {0} has no record: give thumbnails of samples that exist")]
    UnknownSample(u32),
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
        /// The encoder's error.
        source: image::ImageError,
    },
}
