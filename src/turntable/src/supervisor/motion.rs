//! Monitoring a motion: whether it continues, and where it ends.

use super::{ControllerFeatures, MotionFault};
use crate::codes::Alarm;
use crate::protocol::{ControllerState, StatusReport};

/// Longest silence of a controller in motion, microseconds.
const SILENCE_US: i64 = 2_000_000;
/// How long a moving table may report the same position, microseconds.
const STALL_US: i64 = 800_000;
/// How long a table may stand away from its target, microseconds: between accepting a line and
/// starting, a controller is idle for a moment.
const ASTRAY_US: i64 = 600_000;
/// Number of reports in a row from farther away than the table has been, that show that the controller
/// counts from another place: a single one can be damaged.
const FARTHER: u32 = 2;

/// The goal of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum MotionGoal {
    /// Move to a position.
    To {
        /// The position, degrees from machine zero.
        target_deg: f64,
        /// Time limit after the controller has accepted the line, microseconds.
        within_us: i64,
    },
    /// Search for the index.
    Homing,
}

/// A motion in progress.
#[derive(Debug)]
pub(crate) struct Motion {
    goal: MotionGoal,
    accepted_us: Option<i64>,
    last_report_us: i64,
    /// The last reported position, and the time of its first report.
    place: Option<(f64, i64)>,
    /// Where it was in motion, by the last report.
    moved_at: Option<f64>,
    /// The smallest distance from the target that two reports in a row agree on, degrees, the last
    /// report's distance, and the number of reports in a row that are farther away.
    nearest: Option<f64>,
    distance: Option<f64>,
    farther: u32,
    at_target: bool,
}

impl Motion {
    pub(super) fn new(now_us: i64, goal: MotionGoal) -> Self {
        Self {
            goal,
            accepted_us: None,
            last_report_us: now_us,
            place: None,
            moved_at: None,
            nearest: None,
            distance: None,
            farther: 0,
            at_target: false,
        }
    }

    pub(super) fn accepted(&mut self, now_us: i64) {
        self.accepted_us = Some(now_us);
        self.place = None;
    }

    /// Whether the table rests at its target.
    pub(crate) fn is_at_target(&self) -> bool {
        self.at_target
    }

    /// Processes a report; returns the fault that it shows.
    pub(super) fn on_report(
        &mut self,
        report: &StatusReport,
        alarm: Option<Alarm>,
        traits: &ControllerFeatures,
    ) -> Option<MotionFault> {
        self.last_report_us = report.came_us;
        let MotionGoal::To { target_deg, .. } = self.goal else {
            return None;
        };
        let stands_us = self.stands_for(report);
        match report.state {
            ControllerState::Run | ControllerState::Jog => {
                self.moved_at = Some(report.machine_deg);
                (stands_us > STALL_US).then_some(MotionFault::Stalled {
                    machine_deg: report.machine_deg,
                })
            }
            ControllerState::Idle => self.on_idle(report, target_deg, stands_us, traits),
            ControllerState::Held | ControllerState::Holding => Some(MotionFault::Held),
            ControllerState::Alarm => Some(MotionFault::Alarm(
                alarm.unwrap_or(Alarm::unknown(traits.family)),
            )),
            state @ (ControllerState::Home | ControllerState::Check) => Some(MotionFault::Astray {
                state,
                machine_deg: report.machine_deg,
                target_deg,
            }),
            // The name may be damaged. A motion that does not go on is late in the end.
            ControllerState::Unknown => None,
        }
    }

    /// Whether the table is reported farther from its target than it has been. It only comes nearer,
    /// unless the controller has restarted and counts from another place.
    pub(super) fn went_back(&mut self, report: &StatusReport, tolerance_deg: f64) -> bool {
        let MotionGoal::To { target_deg, .. } = self.goal else {
            return false;
        };
        let distance = (report.machine_deg - target_deg).abs();
        let nearest = self.nearest.unwrap_or(f64::INFINITY);
        if distance > nearest + tolerance_deg {
            self.farther += 1;
        } else {
            let before = self.distance.unwrap_or(f64::INFINITY);
            self.farther = 0;
            self.nearest = Some(distance.max(before).min(nearest));
        }
        self.distance = Some(distance);
        self.farther >= FARTHER
    }

    fn on_idle(
        &mut self,
        report: &StatusReport,
        target_deg: f64,
        stands_us: i64,
        traits: &ControllerFeatures,
    ) -> Option<MotionFault> {
        let accepted_us = self.accepted_us?;
        let after = report
            .asked_us
            .is_some_and(|asked_us| asked_us >= accepted_us);
        let off = (report.machine_deg - target_deg).abs();
        if after && off <= traits.tolerance_deg() {
            self.at_target = true;
            return None;
        }
        if !after || self.at_target || stands_us <= ASTRAY_US {
            return None;
        }
        // After a start, a controller stands where it begins to count.
        let at_zero = report.machine_deg.abs() <= traits.tolerance_deg();
        let moved = self
            .moved_at
            .is_some_and(|at| at.abs() > traits.tolerance_deg());
        Some(if at_zero && moved {
            MotionFault::Restarted(None)
        } else {
            MotionFault::Astray {
                state: ControllerState::Idle,
                machine_deg: report.machine_deg,
                target_deg,
            }
        })
    }

    /// How long the table has certainly been at the position of this report, microseconds: from the
    /// arrival of the first report of it to the request for this one.
    fn stands_for(&mut self, report: &StatusReport) -> i64 {
        match self.place {
            Some((place, since_us)) if place == report.machine_deg => {
                let asked_us = report.asked_us.filter(|_| report.certain);
                asked_us.map_or(0, |asked_us| asked_us - since_us)
            }
            _ => {
                self.place = Some((report.machine_deg, report.came_us));
                0
            }
        }
    }

    /// Time since the controller accepted the line, microseconds.
    fn runs_for(&self, now_us: i64) -> i64 {
        self.accepted_us
            .map_or(0, |accepted_us| now_us - accepted_us)
    }

    /// The fault that the passing of time shows.
    pub(super) fn overdue(&self, now_us: i64, traits: &ControllerFeatures) -> Option<MotionFault> {
        let silent_us = now_us - self.last_report_us;
        match self.goal {
            MotionGoal::Homing if !traits.reports_homing => None,
            MotionGoal::To { within_us, .. }
                if !self.at_target && self.runs_for(now_us) > within_us =>
            {
                Some(MotionFault::Late)
            }
            _ => (silent_us > SILENCE_US).then_some(MotionFault::Silent {
                milliseconds: silent_us / 1000,
            }),
        }
    }
}
