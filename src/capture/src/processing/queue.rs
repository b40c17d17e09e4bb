//! What is to be made of sessions, in which order, and when: the queue, the job under way, and whether the rig leaves
//! time for it, as one state machine without threads, programs or files.
//!
//! ```text
//! submit --> waiting --begin--> under way --finish--> the next step of the same session, or nothing
//! ```
//!
//! While the rig is busy nothing begins, and what is under way is held. A step after which a person has to look ends
//! the steps of its session.

use std::collections::VecDeque;

use crate::command::CommandError;
use crate::state::{
    FinishedJob, ProcessingJob, ProcessingOutcome, ProcessingStatus, ProcessingStep,
};

/// Jobs that can wait.
const MAX_WAITING: usize = 200;
/// How a job ended that was cancelled.
const CANCELLED: &str = "cancelled by a person";
/// Ended jobs that are remembered.
const REMEMBERED: usize = 30;

/// How a step ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct StepOutcome {
    pub(super) outcome: ProcessingOutcome,
    /// In a sentence.
    pub(super) what: String,
    /// Whether the next step makes sense without a person.
    pub(super) goes_on: bool,
}

impl StepOutcome {
    pub(super) fn failed(what: String) -> Self {
        Self {
            outcome: ProcessingOutcome::Failed,
            what,
            goes_on: false,
        }
    }
}

/// Queue and job under way.
#[derive(Debug, Default)]
pub(super) struct ProcessingQueue {
    waiting: VecDeque<ProcessingJob>,
    current: Option<ProcessingJob>,
    finished: VecDeque<FinishedJob>,
    is_rig_busy: bool,
    numbers: u64,
}

impl ProcessingQueue {
    /// Appends steps of a session; returns their number.
    pub(super) fn submit(
        &mut self,
        session: &str,
        steps: &[ProcessingStep],
    ) -> Result<u64, CommandError> {
        let Some((&step, then)) = steps.split_first() else {
            let none = "no step is named: name mask, check or extract";
            return Err(CommandError::Invalid(none.to_owned()));
        };
        if self.has(session) {
            let already =
                format!("{session} is being processed already: wait for it, or cancel it");
            return Err(CommandError::Busy(already));
        }
        if self.waiting.len() >= MAX_WAITING {
            let full = format!("{MAX_WAITING} jobs wait already: let some of them end");
            return Err(CommandError::Busy(full));
        }
        self.numbers += 1;
        self.waiting.push_back(ProcessingJob {
            number: self.numbers,
            session: session.to_owned(),
            step,
            then: then.to_vec(),
            status: ProcessingStatus::Waiting,
            done: 0,
            of: 0,
        });
        Ok(self.numbers)
    }

    /// What is under way and what waits, in that order.
    pub(super) fn jobs(&self) -> impl Iterator<Item = &ProcessingJob> {
        self.current.iter().chain(&self.waiting)
    }

    /// Whether something of this session waits or is under way.
    pub(super) fn has(&self, session: &str) -> bool {
        self.jobs().any(|job| job.session == session)
    }

    /// Takes a job out, or has its program ended. False if no job has that number.
    pub(super) fn cancel(&mut self, number: u64) -> bool {
        if let Some(current) = &mut self.current
            && current.number == number
        {
            current.status = ProcessingStatus::Ending;
            return true;
        }
        let at = self.waiting.iter().position(|job| job.number == number);
        let Some(job) = at.and_then(|at| self.waiting.remove(at)) else {
            return false;
        };
        self.remember(&job, ProcessingOutcome::Cancelled, CANCELLED);
        true
    }

    /// Cancels all of a session.
    pub(super) fn cancel_session(&mut self, session: &str) {
        let of_session = self.jobs().filter(|job| job.session == session);
        let numbers: Vec<u64> = of_session.map(|job| job.number).collect();
        for number in numbers {
            self.cancel(number);
        }
    }

    /// The rig captures or moves, or rests.
    pub(super) fn set_rig_busy(&mut self, is_busy: bool) {
        self.is_rig_busy = is_busy;
        if let Some(current) = &mut self.current
            && current.status != ProcessingStatus::Ending
        {
            current.status = if is_busy {
                ProcessingStatus::Held
            } else {
                ProcessingStatus::Running
            };
        }
    }

    /// What begins now, if anything does.
    pub(super) fn begin(&mut self) -> Option<ProcessingJob> {
        if self.is_rig_busy || self.current.is_some() {
            return None;
        }
        let mut job = self.waiting.pop_front()?;
        job.status = ProcessingStatus::Running;
        self.current = Some(job.clone());
        Some(job)
    }

    /// Whether the program under way is to be held.
    pub(super) fn should_pause(&self) -> bool {
        self.is_current(ProcessingStatus::Held)
    }

    /// Whether the program under way is to end.
    pub(super) fn is_cancelled(&self) -> bool {
        self.is_current(ProcessingStatus::Ending)
    }

    fn is_current(&self, status: ProcessingStatus) -> bool {
        let current = self.current.as_ref();
        current.is_some_and(|current| current.status == status)
    }

    /// The program under way has come so far.
    pub(super) fn advance(&mut self, done: u64, of: u64) {
        if let Some(current) = &mut self.current {
            (current.done, current.of) = (done, of);
        }
    }

    /// The step under way has ended; returns how, as it is shown.
    pub(super) fn finish(&mut self, end: StepOutcome) -> String {
        let Some(mut job) = self.current.take() else {
            return end.what;
        };
        let is_cancelled = job.status == ProcessingStatus::Ending;
        // What was done before the cancel arrived is done.
        let stopped = is_cancelled && end.outcome == ProcessingOutcome::Failed;
        let (outcome, what) = if stopped {
            (ProcessingOutcome::Cancelled, CANCELLED.to_owned())
        } else {
            (end.outcome, end.what)
        };
        self.remember(&job, outcome, &what);
        if end.goes_on && !is_cancelled && !job.then.is_empty() {
            job.step = job.then.remove(0);
            job.status = ProcessingStatus::Waiting;
            (job.done, job.of) = (0, 0);
            self.waiting.push_front(job);
        }
        what
    }

    /// Forgets how masks of this session came out: a person has made another one.
    pub(super) fn forget_masks(&mut self, session: &str) {
        self.finished
            .retain(|job| job.session != session || job.step != ProcessingStep::Mask);
    }

    fn remember(&mut self, job: &ProcessingJob, outcome: ProcessingOutcome, what: &str) {
        if self.finished.len() == REMEMBERED {
            self.finished.pop_front();
        }
        self.finished.push_back(FinishedJob {
            number: job.number,
            session: job.session.clone(),
            step: job.step,
            outcome,
            what: what.to_owned(),
        });
    }

    /// The jobs that ended last, newest last.
    pub(super) fn finished(&self) -> Vec<FinishedJob> {
        self.finished.iter().cloned().collect()
    }
}

#[cfg(test)]
mod tests {
    use super::ProcessingStep::{Check, Extract, Mask};
    use super::*;

    fn end(outcome: ProcessingOutcome, goes_on: bool) -> StepOutcome {
        StepOutcome {
            outcome,
            what: "so it ended".to_owned(),
            goes_on,
        }
    }

    fn begun(queue: &mut ProcessingQueue) -> Option<(String, ProcessingStep)> {
        let begun = queue.begin()?;
        Some((begun.session, begun.step))
    }

    const GOOD: ProcessingOutcome = ProcessingOutcome::Good;

    #[test]
    fn the_steps_of_a_session_follow_each_other_before_another_session_begins() {
        let mut queue = ProcessingQueue::default();
        queue.submit("mug", &[Mask, Check, Extract]).unwrap();
        queue.submit("cow", &[Mask]).unwrap();
        for wanted in [
            ("mug", Mask),
            ("mug", Check),
            ("mug", Extract),
            ("cow", Mask),
        ] {
            let (session, step) = begun(&mut queue).unwrap();
            assert_eq!((session.as_str(), step), wanted);
            assert_eq!(begun(&mut queue), None, "one at a time");
            queue.finish(end(GOOD, true));
        }
        assert_eq!(begun(&mut queue), None);
        assert_eq!(queue.finished().len(), 4);
    }

    #[test]
    fn a_step_that_a_person_has_to_look_at_ends_those_of_its_session_only() {
        let mut queue = ProcessingQueue::default();
        queue.submit("mug", &[Check, Extract]).unwrap();
        queue.submit("cow", &[Mask]).unwrap();
        begun(&mut queue).unwrap();
        queue.finish(end(ProcessingOutcome::Doubtful, false));
        assert_eq!(begun(&mut queue), Some(("cow".to_owned(), Mask)));
    }

    #[test]
    fn nothing_begins_while_the_rig_is_busy_and_what_is_under_way_is_held() {
        let mut queue = ProcessingQueue::default();
        queue.set_rig_busy(true);
        queue.submit("mug", &[Mask, Check]).unwrap();
        assert_eq!(begun(&mut queue), None);
        assert!(!queue.should_pause(), "there is nothing to hold");
        queue.set_rig_busy(false);
        begun(&mut queue).unwrap();
        assert!(!queue.should_pause());
        queue.set_rig_busy(true);
        assert!(queue.should_pause());
        assert_eq!(queue.jobs().next().unwrap().status, ProcessingStatus::Held);
        // A program may end just before it is held.
        queue.finish(end(GOOD, true));
        assert_eq!(
            begun(&mut queue),
            None,
            "the next step waits for the rig too"
        );
        queue.set_rig_busy(false);
        assert_eq!(begun(&mut queue), Some(("mug".to_owned(), Check)));
    }

    #[test]
    fn what_is_cancelled_ends_and_nothing_follows_it() {
        let mut queue = ProcessingQueue::default();
        let mug = queue.submit("mug", &[Mask, Check]).unwrap();
        let cow = queue.submit("cow", &[Mask]).unwrap();
        begun(&mut queue).unwrap();
        queue.set_rig_busy(true);
        assert!(queue.cancel(mug) && queue.cancel(cow));
        assert!(
            queue.is_cancelled() && !queue.should_pause(),
            "it has to run to end"
        );
        assert_eq!(queue.jobs().count(), 1);
        assert_eq!(
            queue.jobs().next().unwrap().status,
            ProcessingStatus::Ending
        );
        queue.finish(end(ProcessingOutcome::Failed, false));
        assert!(queue.jobs().next().is_none() && !queue.cancel(mug));
        let outcomes: Vec<_> = queue.finished().iter().map(|job| job.outcome).collect();
        assert_eq!(outcomes, [ProcessingOutcome::Cancelled; 2]);
    }

    #[test]
    fn a_step_that_was_done_before_its_cancel_arrived_counts_as_done() {
        let mut queue = ProcessingQueue::default();
        let number = queue.submit("mug", &[Mask, Check]).unwrap();
        begun(&mut queue).unwrap();
        queue.cancel(number);
        queue.finish(end(GOOD, true));
        assert_eq!(queue.finished()[0].outcome, GOOD);
        assert_eq!(begun(&mut queue), None);
    }

    #[test]
    fn a_session_is_queued_once_and_again_after_its_end() {
        let mut queue = ProcessingQueue::default();
        queue.submit("mug", &[Mask]).unwrap();
        let again = queue.submit("mug", &[Check]).unwrap_err();
        assert!(
            matches!(&again, CommandError::Busy(why) if why.contains("mug")),
            "{again}"
        );
        begun(&mut queue).unwrap();
        assert!(queue.submit("mug", &[Check]).is_err());
        queue.finish(end(GOOD, true));
        queue.submit("mug", &[Check]).unwrap();
        let nothing = queue.submit("cow", &[]);
        assert!(
            matches!(nothing, Err(CommandError::Invalid(_))),
            "{nothing:?}"
        );
        queue.cancel_session("mug");
        assert!(queue.jobs().next().is_none());
    }

    #[test]
    fn the_queue_has_an_end() {
        let mut queue = ProcessingQueue::default();
        for n in 0..MAX_WAITING {
            queue.submit(&n.to_string(), &[Mask]).unwrap();
        }
        let full = queue.submit("mug", &[Mask]);
        assert!(matches!(full, Err(CommandError::Busy(_))), "{full:?}");
    }
}
