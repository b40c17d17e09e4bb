//! The status of a table.

use super::codes::Alarm;
use super::protocol::{ControllerState, StatusReport};
use super::supervisor::Supervisor;

/// The status of a table by a fresh report.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TableStatus {
    /// The controller's state.
    pub state: ControllerState,
    /// Degrees from the angle 0, or from machine zero if the angle 0 is unknown.
    pub angle_deg: f64,
    /// Degrees from machine zero.
    pub machine_deg: f64,
    /// Speed, degrees a second.
    pub degrees_per_second: f64,
    /// Battery, volts, if the controller measures it.
    pub battery_v: Option<f64>,
    /// Whether the index sensor is active.
    pub index: bool,
    /// Whether the emergency stop is pressed.
    pub emergency_stop: bool,
    /// Whether the angle 0 is known.
    pub homed: bool,
    /// Whether the angle 0 was known until the controller restarted.
    pub restarted: bool,
    /// The alarm that locked the table.
    pub alarm: Option<Alarm>,
}

impl TableStatus {
    pub(super) fn new(report: &StatusReport, supervisor: &Supervisor) -> TableStatus {
        let zero = supervisor.zero_deg();
        TableStatus {
            state: report.state,
            angle_deg: report.machine_deg - zero.unwrap_or(0.0),
            machine_deg: report.machine_deg,
            degrees_per_second: report.feed.unwrap_or(0.0) / 60.0,
            battery_v: report.battery_v,
            index: report.pins.index,
            emergency_stop: report.pins.emergency_stop,
            homed: zero.is_some(),
            restarted: supervisor.has_restarted(),
            alarm: supervisor.alarm(),
        }
    }
}
