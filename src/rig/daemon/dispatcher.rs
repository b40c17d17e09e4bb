//! Between those who give commands, from any thread, and the worker that carries them out.

use std::sync::{Mutex, MutexGuard, PoisonError};

use super::schedule::{Next, Schedule, StopTarget};
use crate::capture::{StopRequest, Stopped};
use crate::clock::Clock;
use crate::state::{Monitor, Phase};

/// What those who give commands and the worker share: the schedule, and where its state is shown.
#[derive(Debug)]
pub(super) struct Dispatcher {
    clock: Clock,
    monitor: Monitor,
    plan: Mutex<Plan>,
}

#[derive(Debug)]
struct Plan {
    schedule: Schedule,
    /// The stop of the job under way: each job has its own.
    stop: StopRequest,
}

impl Dispatcher {
    pub(super) fn new(clock: Clock) -> Self {
        let plan = Plan {
            schedule: Schedule::default(),
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

    /// Changes the schedule, and shows what came of it.
    pub(super) fn change<T>(&self, change: impl FnOnce(&mut Schedule) -> T) -> T {
        let mut plan = self.lock();
        let done = change(&mut plan.schedule);
        self.show(&plan.schedule);
        done
    }

    fn show(&self, schedule: &Schedule) {
        self.monitor.update(|state| {
            state.queue = schedule.queue();
            if schedule.is_free() {
                state.phase = match state.queue.is_empty() {
                    true => Phase::Idle,
                    false => Phase::WaitingForObject,
                };
            }
        });
    }

    /// Stops what is under way, and the table.
    pub(super) fn stop(&self) {
        let mut plan = self.lock();
        if plan.schedule.stop() == StopTarget::Running {
            plan.stop.ask(Stopped::Person);
        }
    }

    /// Takes no more jobs, and stops the one that is under way.
    pub(super) fn end(&self) {
        let mut plan = self.lock();
        plan.schedule.end();
        plan.stop.ask(Stopped::Shutdown);
    }

    /// Shows that the worker has failed; nothing is carried out any more.
    pub(super) fn fail(&self) {
        self.end();
        self.monitor.fault(
            self.clock.now_us(),
            "what drives camera and table failed, which is an error in this program: start it again",
        );
    }

    /// What the worker does now, and how it is stopped.
    pub(super) fn begin(&self) -> (Next, StopRequest) {
        let mut plan = self.lock();
        let next = plan.schedule.begin();
        if matches!(next, Next::Job(_)) {
            plan.stop = StopRequest::new(&self.clock);
        }
        (next, plan.stop.clone())
    }

    fn lock(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
