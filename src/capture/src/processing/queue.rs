//! What is to be made of sessions, and in which order: the queue and the job under way, as one state machine without
//! threads, programs or files.
//!
//! ```text
//! submit --> waiting --begin--> under way --finish--> the next step of the same session, or nothing
//! ```
//!
//! A step after which a person has to look ends the steps of its session.

use std::collections::VecDeque;

use crate::command::CommandError;
use crate::state::{
    FinishedJob, ProcessingJob, ProcessingOutcome, ProcessingStatus, ProcessingStep,
};

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

    /// Takes a job out; returns how it ended, as it is shown. `None` if there is none of that kind.
    pub(super) fn cancel(&mut self, which: impl Fn(&ProcessingJob) -> bool) -> Option<String> {
        let job = self.current.take_if(|job| which(job)).or_else(|| {
            let at = self.waiting.iter().position(&which)?;
            self.waiting.remove(at)
        })?;
        Some(self.remember(&job, ProcessingOutcome::Cancelled, CANCELLED))
    }

    /// Whether a job was begun and has not ended.
    pub(super) fn is_under_way(&self) -> bool {
        self.current.is_some()
    }

    /// The program under way is held while the rig captures or moves.
    pub(super) fn set_held(&mut self, is_held: bool) {
        if let Some(current) = &mut self.current {
            current.status = if is_held {
                ProcessingStatus::Held
            } else {
                ProcessingStatus::Running
            };
        }
    }

    /// What begins now, if anything waits.
    pub(super) fn begin(&mut self) -> Option<&ProcessingJob> {
        let mut job = self.waiting.pop_front()?;
        job.status = ProcessingStatus::Running;
        Some(self.current.insert(job))
    }

    /// The program under way has come so far.
    pub(super) fn advance(&mut self, done: u64, of: u64) {
        if let Some(current) = &mut self.current {
            (current.done, current.of) = (done, of);
        }
    }

    /// The step under way has ended; returns how, as it is shown.
    pub(super) fn finish(&mut self, end: StepOutcome) -> Option<String> {
        let mut job = self.current.take()?;
        let line = self.remember(&job, end.outcome, &end.what);
        if end.goes_on && !job.then.is_empty() {
            job.step = job.then.remove(0);
            job.status = ProcessingStatus::Waiting;
            (job.done, job.of) = (0, 0);
            self.waiting.push_front(job);
        }
        Some(line)
    }

    /// Forgets how masks of this session came out: a person has made another one.
    pub(super) fn forget_masks(&mut self, session: &str) {
        self.finished
            .retain(|job| job.session != session || job.step != ProcessingStep::Mask);
    }

    fn remember(&mut self, job: &ProcessingJob, outcome: ProcessingOutcome, what: &str) -> String {
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
        format!("{}: {}: {what}", job.session, job.step)
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
        Some((begun.session.clone(), begun.step))
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
    fn what_is_cancelled_ends_and_nothing_follows_it() {
        let mut queue = ProcessingQueue::default();
        let mug = queue.submit("mug", &[Mask, Check]).unwrap();
        queue.submit("cow", &[Mask]).unwrap();
        begun(&mut queue).unwrap();
        queue.set_held(true);
        assert_eq!(queue.jobs().next().unwrap().status, ProcessingStatus::Held);
        assert!(queue.cancel(|job| job.number == mug).is_some() && !queue.is_under_way());
        assert!(queue.cancel(|job| job.session == "cow").is_some());
        assert!(queue.jobs().next().is_none());
        assert!(queue.cancel(|job| job.number == mug).is_none());
        assert_eq!(queue.finish(end(GOOD, true)), None);
        let outcomes: Vec<_> = queue.finished().iter().map(|job| job.outcome).collect();
        assert_eq!(outcomes, [ProcessingOutcome::Cancelled; 2]);
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
    }
}
