//! Between those who give commands, from any thread, and the worker that carries them out: one job at a time, and
//! its stop.
//!
//! ```text
//! free --submit--> waiting --begin--> under way --finish--> free
//!   stop: of a free or waiting rig, stopping the table becomes the job; a job under way is stopped
//! ```
//!
//! A stop ends with the job that it was meant for.

use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::capture::{StopReason, StopRequest};
use crate::command::{Command, CommandError};
use crate::state::{Monitor, Phase};
use relit_data::clock::Clock;

/// What the worker does now.
#[derive(Debug, Clone)]
pub(super) enum Next {
    /// Nothing is to be done.
    Idle,
    /// This job, until its stop is requested.
    Job(Command, StopRequest),
    /// No more jobs come.
    End,
}

/// What those who give commands and the worker share: the job, and where the rig's state is shown.
#[derive(Debug)]
pub(super) struct Dispatcher {
    clock: Clock,
    monitor: Monitor,
    plan: Mutex<Plan>,
}

#[derive(Debug)]
struct Plan {
    current: Option<Command>,
    is_running: bool,
    is_ending: bool,
    /// The stop of the job under way: each job has its own.
    stop: StopRequest,
}

impl Dispatcher {
    pub(super) fn new(clock: Clock) -> Self {
        let plan = Plan {
            current: None,
            is_running: false,
            is_ending: false,
            stop: StopRequest::new(&clock),
        };
        Self {
            clock,
            monitor: Monitor::default(),
            plan: Mutex::new(plan),
        }
    }

    pub(super) fn monitor(&self) -> &Monitor {
        &self.monitor
    }

    /// Makes this the job, unless one is running.
    pub(super) fn submit(&self, job: Command) -> Result<(), CommandError> {
        let mut plan = self.lock();
        if plan.is_ending {
            let ending = "the program is ending: start it again";
            return Err(CommandError::Unavailable(ending.to_owned()));
        }
        if let Some(current) = &plan.current {
            return Err(CommandError::Busy(under_way(current)));
        }
        plan.current = Some(job);
        Ok(())
    }

    /// Stops what is under way; a job that has not begun does not begin. Where there is neither, the
    /// table is stopped all the same: it may move on its own account.
    pub(super) fn stop(&self) {
        let mut plan = self.lock();
        match &plan.current {
            _ if plan.is_ending => {}
            Some(Command::Stop) if plan.is_running => {}
            Some(_) if plan.is_running => plan.stop.request(StopReason::Person),
            _ => plan.current = Some(Command::Stop),
        }
    }

    /// Takes no more jobs, and stops the one that is under way.
    pub(super) fn end(&self) {
        let mut plan = self.lock();
        plan.is_ending = true;
        plan.stop.request(StopReason::Shutdown);
    }

    /// What the worker does now.
    pub(super) fn begin(&self) -> Next {
        let mut plan = self.lock();
        if plan.is_ending {
            return Next::End;
        }
        let Some(job) = plan.current.clone().filter(|_| !plan.is_running) else {
            return Next::Idle;
        };
        plan.is_running = true;
        plan.stop = StopRequest::new(&self.clock);
        Next::Job(job, plan.stop.clone())
    }

    /// The job is over.
    pub(super) fn finish(&self) {
        let mut plan = self.lock();
        (plan.current, plan.is_running) = (None, false);
        self.monitor.update(|state| state.phase = Phase::Idle);
    }

    fn lock(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn under_way(job: &Command) -> String {
    match job {
        Command::Start { object } => format!("{object} is being captured: wait for it, or stop it"),
        _ => "the table or the camera is being set: wait a moment".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "a test's own mistakes should be loud")]

    use super::*;

    fn dispatcher() -> Dispatcher {
        Dispatcher::new(Clock::monotonic())
    }

    fn start() -> Command {
        let object = "mug".to_owned();
        Command::Start { object }
    }

    fn begun(dispatcher: &Dispatcher) -> (Command, StopRequest) {
        match dispatcher.begin() {
            Next::Job(job, stop) => (job, stop),
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn one_job_is_taken_at_a_time_and_begins_once() {
        let dispatcher = dispatcher();
        assert!(matches!(dispatcher.begin(), Next::Idle));
        dispatcher.submit(start()).unwrap();
        let refused = dispatcher.submit(Command::Home).unwrap_err();
        assert!(
            matches!(&refused, CommandError::Busy(why) if why.contains("mug")),
            "{refused}"
        );
        assert_eq!(begun(&dispatcher).0, start());
        assert!(matches!(dispatcher.begin(), Next::Idle));
        assert!(matches!(
            dispatcher.submit(Command::Home),
            Err(CommandError::Busy(_))
        ));
        dispatcher.finish();
        dispatcher.submit(Command::Home).unwrap();
        assert_eq!(begun(&dispatcher).0, Command::Home);
    }

    #[test]
    fn a_stop_reaches_the_job_under_way_and_no_later_one() {
        let dispatcher = dispatcher();
        dispatcher.submit(Command::Home).unwrap();
        let (_, stop) = begun(&dispatcher);
        dispatcher.stop();
        assert_eq!(stop.reason(), Some(StopReason::Person));
        dispatcher.finish();
        dispatcher.submit(Command::Home).unwrap();
        assert_eq!(begun(&dispatcher).1.reason(), None);
    }

    #[test]
    fn a_stop_before_a_job_begins_takes_its_place_and_a_free_rig_stops_its_table() {
        let dispatcher = dispatcher();
        dispatcher.submit(start()).unwrap();
        dispatcher.stop();
        let (job, stop) = begun(&dispatcher);
        assert_eq!(job, Command::Stop);
        // It is not stopped itself.
        dispatcher.stop();
        assert_eq!(stop.reason(), None);
        dispatcher.finish();
        dispatcher.stop();
        assert_eq!(begun(&dispatcher).0, Command::Stop);
    }

    #[test]
    fn after_the_end_nothing_begins() {
        let dispatcher = dispatcher();
        dispatcher.submit(Command::Home).unwrap();
        let (_, stop) = begun(&dispatcher);
        dispatcher.stop();
        dispatcher.end();
        assert_eq!(stop.reason(), Some(StopReason::Shutdown));
        dispatcher.finish();
        assert!(matches!(
            dispatcher.submit(Command::Home),
            Err(CommandError::Unavailable(_))
        ));
        dispatcher.stop();
        assert!(matches!(dispatcher.begin(), Next::End));
    }
}
