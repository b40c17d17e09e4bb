//! What was seen of the table, and how its controller tells it.

use std::time::Duration;

use crate::turntable::wire::{Pins, State};

/// A report in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Seen {
    pub(crate) state: State,
    /// Degrees from machine zero.
    pub(crate) machine_deg: f64,
    /// Degrees a second.
    pub(crate) speed: f64,
    pub(crate) chip_us: Option<u32>,
    pub(crate) battery_v: Option<f64>,
    pub(crate) pins: Pins,
    pub(crate) asked_us: Option<i64>,
    pub(crate) came_us: i64,
    /// Whether question and report certainly belong together.
    pub(crate) certain: bool,
}

/// How the controller tells its position, and how often it is asked in motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Habits {
    /// Degrees in one unit of its reports.
    pub(crate) degrees_per_unit: f64,
    /// Between two reports in motion.
    pub(crate) poll: Duration,
    /// Whether its reports carry the chip's time.
    pub(crate) stamps: bool,
    /// Whether it answers `?` while it looks for the index.
    pub(crate) reports_homing: bool,
    /// Smallest distance it can stand off its target, degrees.
    pub(crate) step_deg: f64,
}
