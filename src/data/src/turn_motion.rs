//! A turn of the table as it was planned, and as the table reported it: plain values, which turntables give and the journal of
//! a session keeps.

use serde::{Deserialize, Serialize};

/// A turn as it was planned, degrees from machine zero.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JournaledTurn {
    /// Where the part at constant speed starts.
    pub from_deg: f64,
    /// Where it ends.
    pub to_deg: f64,
    /// Speed, degrees a second, without sign.
    pub degrees_per_second: f64,
    /// Machine position of the angle 0.
    pub zero_deg: f64,
    /// One step.
    pub step_deg: f64,
}

/// Where the table was at some time, as it reported in the part at constant speed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct JournaledReport {
    /// When the report was requested, microseconds of the clock that stamps the frames.
    pub asked_us: i64,
    /// When it came, on the same clock.
    pub came_us: i64,
    /// The controller's own time of the position, microseconds; it wraps.
    pub chip_us: Option<u32>,
    /// The position, degrees from machine zero.
    pub machine_deg: f64,
}
