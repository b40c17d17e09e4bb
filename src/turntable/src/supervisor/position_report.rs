//! Status reports converted to degrees.

use std::time::Duration;

use crate::family::Family;
use crate::protocol::{ControllerState, Pins, Poll};

/// Rounding error of a printed position, degrees.
const PRINTED_DEG: f64 = 0.002;

/// A status report in degrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PositionReport {
    pub(crate) state: ControllerState,
    /// The alarm's number, if the state came with it.
    pub(crate) alarm: Option<u8>,
    /// Whether the controller counts itself as homed, if it says so.
    pub(crate) homed: Option<bool>,
    /// Degrees from machine zero.
    pub(crate) machine_deg: f64,
    /// Degrees/s.
    pub(crate) speed: f64,
    pub(crate) chip_us: Option<u32>,
    pub(crate) battery_v: Option<f64>,
    pub(crate) pins: Pins,
    pub(crate) asked_us: Option<i64>,
    pub(crate) came_us: i64,
    /// Whether the report certainly answers the request at `asked_us`.
    pub(crate) certain: bool,
}

impl PositionReport {
    /// Converts a report.
    pub(super) fn from_poll(poll: &Poll, traits: &ControllerFeatures) -> PositionReport {
        let report = poll.report;
        PositionReport {
            state: report.state,
            alarm: report.alarm,
            homed: report.homed,
            machine_deg: report.position,
            speed: report.feed.unwrap_or(0.0) / 60.0,
            chip_us: report.chip_us.filter(|_| traits.stamps),
            battery_v: report.battery_v,
            pins: report.pins,
            asked_us: poll.asked_us,
            came_us: poll.came_us,
            certain: poll.certain,
        }
    }

    /// Whether the next report agrees with this one. In motion, positions differ.
    pub(super) fn confirms(&self, next: &PositionReport) -> bool {
        let same = self.machine_deg == next.machine_deg || next.state.may_move();
        self.state == next.state && self.alarm == next.alarm && same
    }
}

/// What has to be known of a controller to read its reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ControllerFeatures {
    /// Whose alarms it reports.
    pub(crate) family: Family,
    /// Interval of reports in motion.
    pub(crate) poll: Duration,
    /// Whether its reports carry the chip's time.
    pub(crate) stamps: bool,
    /// Whether it answers `?` while it searches for the index.
    pub(crate) reports_homing: bool,
    /// One step, degrees: how far it may stand from its target.
    pub(crate) step_deg: f64,
}

impl ControllerFeatures {
    /// How far two reports of the same place can lie apart, degrees.
    pub(super) fn tolerance_deg(&self) -> f64 {
        self.step_deg + PRINTED_DEG
    }
}
