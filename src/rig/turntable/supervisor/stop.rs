//! Bringing the table to a standstill, and making sure that it stands.
//!
//! `!` ramps it down; at a standstill a reset drops what it was still to do, and so loses no
//! position. Only where the table does not answer, or does not slow down, is it reset in motion.

use super::Seen;
use crate::turntable::wire::{Machine, State, realtime};

/// How often a stop byte is sent again, microseconds.
const REPEAT_US: i64 = 250_000;
/// How often a reset is sent again, microseconds.
const RESET_REPEAT_US: i64 = 1_000_000;
/// How long a table that answers may take to ramp down, microseconds.
const RAMP_US: i64 = 5_000_000;
/// How long a table may be silent before it is reset in motion, microseconds.
const SILENT_US: i64 = 800_000;
/// How long a controller may take to restart, microseconds.
const RESTART_US: i64 = 4_000_000;
/// How long it may take to be seen at rest after that, microseconds.
const CHECK_US: i64 = 2_000_000;
/// So many reports of the same place, asked for after the stop, are a standstill.
const STANDING: u32 = 2;

/// How a stop ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum StopOutcome {
    /// The table was seen at rest.
    Standing,
    /// The table was seen at rest, and counts its position from elsewhere than before.
    Displaced,
    /// Nobody can tell: it does not answer, or goes on moving.
    Unknown,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    /// `!` was sent.
    Braking,
    /// A reset was sent; `gentle` when the table stood.
    Resetting {
        gentle: bool,
    },
    /// It has restarted; it is to be seen at rest.
    Checking,
    Done(StopOutcome),
}

/// A stop under way, or its end.
#[derive(Debug)]
pub(crate) struct Stop {
    phase: Phase,
    since_us: i64,
    sent_us: i64,
    heard_us: i64,
    /// Something is left in the controller or on the wire that only a reset drops.
    unsettled: bool,
    standing: Option<(f64, u32)>,
    /// Where it stood before it was reset gently.
    stood_at: Option<f64>,
}

impl Stop {
    /// Sends the feed hold. `unsettled`: a line without answer may still be executed.
    pub(super) fn begin(now_us: i64, unsettled: bool, wire: &mut Machine) -> Self {
        wire.realtime(realtime::HOLD);
        Self {
            phase: Phase::Braking,
            since_us: now_us,
            sent_us: now_us,
            heard_us: now_us,
            unsettled,
            standing: None,
            stood_at: None,
        }
    }

    pub(crate) fn outcome(&self) -> Option<StopOutcome> {
        match self.phase {
            Phase::Done(outcome) => Some(outcome),
            _ => None,
        }
    }

    fn enter(&mut self, now_us: i64, phase: Phase) {
        self.phase = phase;
        self.since_us = now_us;
        self.sent_us = now_us;
        self.standing = None;
    }

    fn reset(&mut self, now_us: i64, gentle: bool, wire: &mut Machine) {
        wire.realtime(realtime::RESET);
        self.enter(now_us, Phase::Resetting { gentle });
    }

    pub(super) fn on_time(&mut self, now_us: i64, wire: &mut Machine) {
        let lasted_us = now_us - self.since_us;
        let unsent_us = now_us - self.sent_us;
        match self.phase {
            Phase::Braking if now_us - self.heard_us > SILENT_US || lasted_us > RAMP_US => {
                self.reset(now_us, false, wire);
            }
            Phase::Braking if unsent_us >= REPEAT_US && self.standing.is_none() => {
                self.sent_us = now_us;
                wire.realtime(realtime::HOLD);
            }
            Phase::Resetting { .. } if lasted_us > RESTART_US => {
                self.enter(now_us, Phase::Done(StopOutcome::Unknown));
            }
            Phase::Resetting { .. } if unsent_us >= RESET_REPEAT_US => {
                self.sent_us = now_us;
                wire.realtime(realtime::RESET);
            }
            Phase::Checking if lasted_us > CHECK_US => {
                self.enter(now_us, Phase::Done(StopOutcome::Unknown));
            }
            _ => {}
        }
    }

    /// The controller has restarted. Whether that is the reset of a standing table, which keeps
    /// its position.
    pub(super) fn on_reset(&mut self, now_us: i64) -> bool {
        let gentle = self.phase == Phase::Resetting { gentle: true };
        if self.outcome().is_none() {
            self.enter(now_us, Phase::Checking);
        }
        gentle
    }

    pub(super) fn on_report(&mut self, now_us: i64, seen: &Seen, wire: &mut Machine) {
        self.heard_us = now_us;
        if seen
            .asked_us
            .is_none_or(|asked_us| asked_us < self.since_us)
        {
            return;
        }
        match (self.phase, seen.state) {
            // Only a reset ends a search for the index.
            (Phase::Braking, State::Home) => self.reset(now_us, false, wire),
            (Phase::Braking | Phase::Checking, state) if state.may_move() => self.standing = None,
            (Phase::Braking, state) if self.stands(seen) => {
                if self.unsettled || matches!(state, State::Held) {
                    self.stood_at = Some(seen.machine_deg);
                    self.reset(now_us, true, wire);
                } else {
                    self.enter(now_us, Phase::Done(StopOutcome::Standing));
                }
            }
            (Phase::Checking, _) if self.stands(seen) => {
                let same = self.stood_at.is_none_or(|place| place == seen.machine_deg);
                let outcome = if same {
                    StopOutcome::Standing
                } else {
                    StopOutcome::Displaced
                };
                self.enter(now_us, Phase::Done(outcome));
            }
            _ => {}
        }
    }

    fn stands(&mut self, seen: &Seen) -> bool {
        let count = match self.standing {
            Some((place, count)) if place == seen.machine_deg => count + 1,
            _ => 1,
        };
        self.standing = Some((seen.machine_deg, count));
        count >= STANDING
    }
}
