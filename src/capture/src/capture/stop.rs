//! A request to stop that reaches a capture wherever it is, also while it waits for the table.

use std::sync::Arc;

use super::error::{CaptureError, StopReason};
use relit_data::clock::{Clock, Waitable};
use relit_turntable::{Table, TurntableError};

/// A stop that may be requested at any time, from any thread; clones are the same request.
#[derive(Debug, Clone)]
pub struct StopRequest {
    state: Arc<Waitable<State>>,
}

#[derive(Debug, Default)]
struct State {
    asked: Option<StopReason>,
    /// Motions that were watched and have ended.
    ended: u64,
}

impl StopRequest {
    /// Nobody has asked yet. `clock`: that of the capture.
    pub fn new(clock: &Clock) -> Self {
        Self {
            state: Arc::new(Waitable::new(clock, State::default())),
        }
    }

    /// Asks for a stop. The end of the program outranks a person.
    pub fn request(&self, who: StopReason) {
        self.state
            .update(|state| state.asked = state.asked.max(Some(who)));
    }

    /// Who asked, if anybody did.
    pub fn reason(&self) -> Option<StopReason> {
        self.state.lock().asked
    }

    /// An error where somebody asked.
    ///
    /// # Errors
    /// [`StopReason`].
    pub fn check(&self) -> Result<(), StopReason> {
        self.reason().map_or(Ok(()), Err)
    }

    /// The result of something that may have been stopped: that a stop was requested explains an
    /// error better than its consequences do, unless the table did not obey.
    ///
    /// # Errors
    /// [`CaptureError::Stopped`], or the error itself.
    pub fn explain<T>(&self, result: Result<T, CaptureError>) -> Result<T, CaptureError> {
        result.map_err(|error| match (self.reason(), &error) {
            (Some(_), CaptureError::Turntable(TurntableError::NotStopped)) | (None, _) => error,
            (Some(who), _) => who.into(),
        })
    }

    /// Runs `motion`, and stops the table as soon as somebody asks, so that what waits for the table
    /// in `motion` returns.
    ///
    /// # Errors
    /// What `motion` answers, or that the system gives no thread.
    pub fn over<T, E: Into<CaptureError>>(
        &self,
        table: &Table,
        motion: impl FnOnce() -> Result<T, E>,
    ) -> Result<T, CaptureError> {
        let ended = self.state.lock().ended;
        self.state.clock().scope(|scope| {
            let watcher = scope.spawn("relit-stop", || {
                let asked = self.state.wait(|state| match state.asked {
                    _ if state.ended > ended => Some(false),
                    asked => asked.map(|_| true),
                });
                if asked {
                    // What waits for the table reports what came of it.
                    let _ = table.stop();
                }
            });
            let _end = EndAtDrop(&self.state);
            watcher.map_err(CaptureError::system("a thread", "started"))?;
            motion().map_err(Into::into)
        })
    }
}

/// Counts a motion as ended however its block is left.
struct EndAtDrop<'a>(&'a Waitable<State>);

impl Drop for EndAtDrop<'_> {
    fn drop(&mut self) {
        self.0.update(|state| state.ended += 1);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stop_explains_every_error_but_that_of_a_table_that_did_not_obey() {
        let stop = StopRequest::new(&Clock::monotonic());
        let fails = |error: TurntableError| stop.explain(Err::<(), _>(error.into())).unwrap_err();
        let is_stopped = |error| matches!(error, CaptureError::Stopped(StopReason::Person));
        assert!(!is_stopped(fails(TurntableError::NotHomed)));
        stop.request(StopReason::Person);
        assert!(is_stopped(fails(TurntableError::NotHomed)));
        assert!(!is_stopped(fails(TurntableError::NotStopped)));
        assert!(stop.explain(Ok(())).is_ok());
    }

    #[test]
    fn the_end_of_the_program_outranks_a_person() {
        let stop = StopRequest::new(&Clock::monotonic());
        assert_eq!(stop.check(), Ok(()));
        stop.request(StopReason::Person);
        assert_eq!(stop.reason(), Some(StopReason::Person));
        stop.clone().request(StopReason::Shutdown);
        stop.request(StopReason::Person);
        assert_eq!(stop.check(), Err(StopReason::Shutdown));
    }
}
