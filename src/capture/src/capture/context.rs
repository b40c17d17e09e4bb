//! Who follows a capture.

use super::stop::StopRequest;
use crate::preview::Preview;
use crate::state::{Check, Monitor, Phase, TakeSummary};

/// Who follows a capture, and who may stop it.
#[derive(Debug, Clone, Copy)]
pub struct CaptureContext<'a> {
    /// Gets the state.
    pub monitor: &'a Monitor,
    /// Gets the frames.
    pub preview: Option<&'a Preview>,
    /// May be requested at any time.
    pub stop: &'a StopRequest,
}

impl CaptureContext<'_> {
    pub(super) fn enter(&self, phase: Phase) {
        self.monitor.update(|state| state.phase = phase);
    }

    pub(super) fn note(&self, checks: impl IntoIterator<Item = Check>) {
        self.monitor.update(|state| state.checks.extend(checks));
    }

    /// Shows how a take came out.
    pub(super) fn end_take(&self, take: &TakeSummary) {
        self.monitor.update(|state| {
            (state.frames, state.dropped) = (take.frames, take.dropped);
            state.session = None;
            state.note(format!("{}: {} frames", take.session, take.frames));
            for note in &take.notes {
                state.note(note.clone());
            }
            state.last_take = Some(take.clone());
        });
    }

    /// Shows that a take of `object` begins.
    pub(super) fn begin_take(&self, object: &str) {
        self.monitor.update(|state| {
            state.phase = Phase::Preflight;
            state.object = Some(object.to_owned());
            (state.frames, state.frames_wanted, state.dropped) = (0, 0, 0);
            state.checks.clear();
            state.session = None;
        });
    }
}
