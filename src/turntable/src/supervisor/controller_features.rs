//! What has to be known of a controller to read its reports.

use std::time::Duration;

use crate::family::Family;

/// Rounding error of a printed position, degrees.
const PRINTED_DEG: f64 = 0.002;

/// What has to be known of a controller to read its reports.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
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
