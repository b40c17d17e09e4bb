//! What the rig is doing, for terminal, page and metrics.
//!
//! One [`Monitor`] a rig. The capture writes into it, any number of viewers read or subscribe; none of
//! them can hold the capture up. What follows from it for the person at the rig is [`Advice`]. This module
//! knows no other module.

mod advice;
mod parts;
mod processing;

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use jiff::Timestamp;
use serde::Serialize;
use tokio::sync::watch;

pub use advice::{Advice, AdvisedAction, AdvisedButton, Obstacle};
pub use parts::{
    CameraState, CaptureSettings, Check, FaultLine, LogLine, Phase, TableState, TakeSummary,
    Verdict,
};
pub use processing::{
    FinishedJob, ProcessingJob, ProcessingOutcome, ProcessingState, ProcessingStatus,
    ProcessingStep,
};

/// Faults kept for display; older ones are in the sessions' manifests.
const FAULTS_KEPT: usize = 50;

/// Lines of the log kept for display.
const LOG_KEPT: usize = 40;

/// All that a viewer may know.
#[derive(Debug, Clone, PartialEq, Serialize, Default)]
pub struct RigState {
    /// Counts changes: a viewer that has seen this number has seen this state.
    pub version: u64,
    /// Where the capture stands.
    pub phase: Phase,
    /// The object on the table.
    pub object: Option<String>,
    /// The session being written.
    pub session: Option<String>,
    /// Frames written of the present take.
    pub frames: u64,
    /// Frames that the present take is to have.
    pub frames_wanted: u64,
    /// Frames found missing so far.
    pub dropped: u64,
    /// The table.
    pub table: TableState,
    /// The camera.
    pub camera: CameraState,
    /// Bytes free where sessions are written.
    pub free_bytes: u64,
    /// Bytes that a take is expected to need.
    pub needed_bytes: u64,
    /// What is wrong with the folder of sessions, in a sentence.
    pub disk_fault: Option<String>,
    /// What the last preflight found.
    pub checks: Vec<Check>,
    /// Newest last.
    pub faults: VecDeque<FaultLine>,
    /// The last finished take.
    pub last_take: Option<TakeSummary>,
    /// How takes are captured.
    pub settings: CaptureSettings,
    /// What happened last, newest last.
    pub log: VecDeque<LogLine>,
    /// What is made of the sessions.
    pub processing: ProcessingState,
    /// What follows from all this for the person at the rig.
    pub advice: Advice,
}

impl RigState {
    /// Whether the rig has a table, be it there at the moment or not.
    pub fn has_table(&self) -> bool {
        !matches!(self.settings.turntable.as_str(), "" | "none")
    }

    /// Adds a line to the log that is shown.
    pub fn note(&mut self, what: impl Into<String>) {
        let what = what.into();
        if self.log.len() == LOG_KEPT {
            self.log.pop_front();
        }
        let at = Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string();
        self.log.push_back(LogLine { at, what });
    }
}

/// A picture for viewers.
#[derive(Debug, Clone, PartialEq)]
pub struct PreviewFrame {
    /// Counts frames, so that a viewer knows a new one.
    pub number: u64,
    /// Microseconds of the capture's clock.
    pub t_us: i64,
    /// A whole JPEG file.
    pub jpeg: Arc<[u8]>,
}

/// The rig's state and newest picture, shared between one capture and its viewers.
#[derive(Debug, Clone, Default)]
pub struct Monitor {
    shared: Arc<Shared>,
}

#[derive(Debug, Default)]
struct Shared {
    state: Mutex<RigState>,
    changed: Condvar,
    version: watch::Sender<u64>,
    picture: watch::Sender<Option<PreviewFrame>>,
}

impl Monitor {
    /// The state now.
    pub fn state(&self) -> RigState {
        lock(&self.shared.state).clone()
    }

    /// Changes the state and wakes those who wait for a change.
    pub fn update(&self, change: impl FnOnce(&mut RigState)) {
        let mut state = lock(&self.shared.state);
        let before = state.phase;
        change(&mut state);
        if state.phase != before {
            let phase = state.phase.to_string();
            state.note(phase);
        }
        state.advice = Advice::from_state(&state);
        state.version = state.version.wrapping_add(1);
        self.shared.changed.notify_all();
        self.shared.version.send_replace(state.version);
    }

    /// Adds a fault to the list that is shown.
    pub fn fault(&self, t_us: i64, what: impl Into<String>) {
        let line = FaultLine {
            t_us,
            what: what.into(),
        };
        self.update(|state| {
            if state.faults.len() == FAULTS_KEPT {
                state.faults.pop_front();
            }
            state.note(line.what.clone());
            state.faults.push_back(line);
        });
    }

    /// The state once it is newer than `seen`, or as it is after `timeout`.
    pub fn wait_newer(&self, seen: u64, timeout: Duration) -> RigState {
        let state = lock(&self.shared.state);
        let (state, _) = self
            .shared
            .changed
            .wait_timeout_while(state, timeout, |state| state.version == seen)
            .unwrap_or_else(PoisonError::into_inner);
        state.clone()
    }

    /// The versions of the state as they come; who falls behind skips some.
    pub fn versions(&self) -> watch::Receiver<u64> {
        self.shared.version.subscribe()
    }

    /// Shows a picture; the one before is forgotten.
    pub fn show(&self, t_us: i64, jpeg: Arc<[u8]>) {
        self.shared.picture.send_modify(|picture| {
            let number = picture.as_ref().map_or(0, |last| last.number) + 1;
            *picture = Some(PreviewFrame { number, t_us, jpeg });
        });
    }

    /// The newest picture.
    pub fn preview(&self) -> Option<PreviewFrame> {
        self.shared.picture.borrow().clone()
    }

    /// The newest picture, again and again; who falls behind skips some.
    pub fn pictures(&self) -> watch::Receiver<Option<PreviewFrame>> {
        self.shared.picture.subscribe()
    }

    /// Whether anybody is waiting for pictures.
    pub fn is_watched(&self) -> bool {
        self.shared.picture.receiver_count() > 0
    }
}

/// A viewer that panicked left the value whole: every change is made under one lock.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rig_of_which_nothing_is_known_has_its_own_advice() {
        let state = RigState::default();
        assert_eq!(Advice::default(), Advice::from_state(&state));
    }
}
