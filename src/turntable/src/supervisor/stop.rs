//! Bringing the table to a standstill and verifying that it stands.
//!
//! `!` ramps the table down. At a standstill, a reset discards the remaining motions without losing
//! the position. The table is reset in motion only if it does not answer or does not slow down.

use crate::protocol::{ControllerState, Machine, StatusReport, realtime};

/// Interval at which the feed hold is repeated, microseconds.
const REPEAT_US: i64 = 250_000;
/// Interval at which a reset is repeated, microseconds.
const RESET_REPEAT_US: i64 = 1_000_000;
/// Longest ramp down of a table that answers, microseconds.
const RAMP_US: i64 = 5_000_000;
/// Longest silence before the table is reset in motion, microseconds.
const SILENT_US: i64 = 800_000;
/// Longest restart of a controller, microseconds.
const RESTART_US: i64 = 4_000_000;
/// Time after a reset from which reports at rest show that it was carried out without a banner,
/// microseconds: it has been sent several times by then.
const NO_BANNER_US: i64 = 2_500_000;
/// Longest wait for reports at rest after a restart, microseconds.
const CHECK_US: i64 = 2_000_000;
/// Number of reports of the same position, requested after the stop, that prove a standstill.
const STANDING: u32 = 2;

/// How a stop ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopOutcome {
    /// The table was reported at rest.
    Stopped,
    /// The table was reported at rest, but at another position than before the reset: the controller
    /// has lost its position.
    Displaced,
    /// Unknown: it does not answer, or still moves.
    Unknown,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    /// `!` was sent.
    Braking,
    /// A reset was sent; `gentle` if the table stood.
    Resetting {
        gentle: bool,
    },
    /// It has restarted and has to be reported at rest.
    Checking,
    Done(StopOutcome),
}

/// A stop in progress, or its result.
#[derive(Debug)]
pub(crate) struct Stop {
    step: Step,
    since_us: i64,
    sent_us: i64,
    heard_us: i64,
    /// Something is left in the controller or on the line that only a reset discards.
    unsettled: bool,
    standing: Option<(f64, u32)>,
    /// Where it stood before it was reset at a standstill.
    stood_at: Option<f64>,
}

impl Stop {
    /// Sends the feed hold. `unsettled`: a line without answer may still be executed.
    pub(super) fn begin(now_us: i64, unsettled: bool, machine: &mut Machine) -> Self {
        machine.realtime(realtime::HOLD);
        Self {
            step: Step::Braking,
            since_us: now_us,
            sent_us: now_us,
            heard_us: now_us,
            unsettled,
            standing: None,
            stood_at: None,
        }
    }

    pub(crate) fn outcome(&self) -> Option<StopOutcome> {
        match self.step {
            Step::Done(outcome) => Some(outcome),
            _ => None,
        }
    }

    fn enter(&mut self, now_us: i64, step: Step) {
        self.step = step;
        self.since_us = now_us;
        self.sent_us = now_us;
        self.standing = None;
    }

    fn reset(&mut self, now_us: i64, gentle: bool, machine: &mut Machine) {
        machine.realtime(realtime::RESET);
        self.enter(now_us, Step::Resetting { gentle });
    }

    pub(super) fn on_time(&mut self, now_us: i64, machine: &mut Machine) {
        let lasted_us = now_us - self.since_us;
        let unsent_us = now_us - self.sent_us;
        match self.step {
            Step::Braking if now_us - self.heard_us > SILENT_US || lasted_us > RAMP_US => {
                self.reset(now_us, false, machine);
            }
            Step::Braking if unsent_us >= REPEAT_US && self.standing.is_none() => {
                self.sent_us = now_us;
                machine.realtime(realtime::HOLD);
            }
            Step::Resetting { .. } if lasted_us > RESTART_US => {
                self.enter(now_us, Step::Done(StopOutcome::Unknown));
            }
            Step::Resetting { .. } if unsent_us >= RESET_REPEAT_US => {
                self.sent_us = now_us;
                machine.realtime(realtime::RESET);
            }
            Step::Checking if lasted_us > CHECK_US => {
                self.enter(now_us, Step::Done(StopOutcome::Unknown));
            }
            _ => {}
        }
    }

    /// Notes that the controller has restarted; returns whether this was the reset of a standing
    /// table, which keeps its position.
    pub(super) fn on_reset(&mut self, now_us: i64) -> bool {
        let gentle = self.step == Step::Resetting { gentle: true };
        if self.outcome().is_none() {
            self.enter(now_us, Step::Checking);
        }
        gentle
    }

    pub(super) fn on_report(&mut self, now_us: i64, report: &StatusReport, machine: &mut Machine) {
        self.heard_us = now_us;
        if report
            .asked_us
            .is_none_or(|asked_us| asked_us < self.since_us)
        {
            return;
        }
        match (self.step, report.state) {
            // Only a reset ends a search for the index.
            (Step::Braking, ControllerState::Home) => self.reset(now_us, false, machine),
            (Step::Braking | Step::Checking, state) if state.may_move() => self.standing = None,
            (Step::Braking, state) if self.stands(report) => {
                // Only a reset leads out of these, and it discards what is left of the motion.
                let waits = matches!(state, ControllerState::Held | ControllerState::Unknown);
                if self.unsettled || waits {
                    self.stood_at = Some(report.machine_deg);
                    self.reset(now_us, true, machine);
                } else {
                    self.enter(now_us, Step::Done(StopOutcome::Stopped));
                }
            }
            (Step::Resetting { .. }, ControllerState::Idle | ControllerState::Alarm)
                if now_us - self.since_us > NO_BANNER_US && self.stands(report) =>
            {
                machine.assume_reset();
            }
            (Step::Checking, _) if self.stands(report) => {
                let same = self
                    .stood_at
                    .is_none_or(|place| place == report.machine_deg);
                let outcome = if same {
                    StopOutcome::Stopped
                } else {
                    StopOutcome::Displaced
                };
                self.enter(now_us, Step::Done(outcome));
            }
            _ => {}
        }
    }

    fn stands(&mut self, report: &StatusReport) -> bool {
        let count = match self.standing {
            Some((place, count)) if place == report.machine_deg => count + 1,
            _ => 1,
        };
        self.standing = Some((report.machine_deg, count));
        count >= STANDING
    }
}
