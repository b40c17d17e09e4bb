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

/// A session and what is still to be done with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct PendingWork {
    pub(super) session: String,
    /// At least one.
    pub(super) steps: Vec<ProcessingStep>,
}

/// How a step ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct StepOutcome {
    pub(super) outcome: ProcessingOutcome,
    /// In a sentence.
    pub(super) what: String,
    /// Whether the next step makes sense without a person.
    pub(super) goes_on: bool,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Entry {
    number: u64,
    work: PendingWork,
}

#[derive(Debug)]
struct UnderWay {
    entry: Entry,
    step: ProcessingStep,
    done: u64,
    of: u64,
    is_cancelled: bool,
}

/// What the runner begins.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct StartedStep {
    pub(super) session: String,
    pub(super) step: ProcessingStep,
}

/// Queue and job under way.
#[derive(Debug, Default)]
pub(super) struct ProcessingQueue {
    waiting: VecDeque<Entry>,
    current: Option<UnderWay>,
    finished: VecDeque<FinishedJob>,
    is_rig_busy: bool,
    numbers: u64,
}

impl ProcessingQueue {
    /// Appends work; returns its number.
    pub(super) fn submit(&mut self, work: PendingWork) -> Result<u64, CommandError> {
        if work.steps.is_empty() {
            let none = "no step is named: name mask, check or extract";
            return Err(CommandError::Invalid(none.to_owned()));
        }
        if self.has(&work.session) {
            let what = &work.session;
            let already = format!("{what} is being processed already: wait for it, or cancel it");
            return Err(CommandError::Busy(already));
        }
        if self.waiting.len() >= MAX_WAITING {
            let full = format!("{MAX_WAITING} jobs wait already: let some of them end");
            return Err(CommandError::Busy(full));
        }
        self.numbers += 1;
        self.waiting.push_back(Entry {
            number: self.numbers,
            work,
        });
        Ok(self.numbers)
    }

    /// Whether something of this session waits or is under way.
    pub(super) fn has(&self, session: &str) -> bool {
        let current = self.current.iter().map(|current| &current.entry);
        let mut all = self.waiting.iter().chain(current);
        all.any(|entry| entry.work.session == session)
    }

    /// Takes a job out, or has its program ended. False if no job has that number.
    pub(super) fn cancel(&mut self, number: u64) -> bool {
        if let Some(current) = &mut self.current
            && current.entry.number == number
        {
            current.is_cancelled = true;
            return true;
        }
        let Some(at) = self.waiting.iter().position(|entry| entry.number == number) else {
            return false;
        };
        if let Some(entry) = self.waiting.remove(at)
            && let Some(&step) = entry.work.steps.first()
        {
            self.remember(entry, step, ProcessingOutcome::Cancelled, CANCELLED);
        }
        true
    }

    /// Cancels all of a session.
    pub(super) fn cancel_session(&mut self, session: &str) {
        let current = self.current.iter().map(|current| &current.entry);
        let of_session = self.waiting.iter().chain(current);
        let of_session = of_session.filter(|entry| entry.work.session == session);
        let numbers: Vec<u64> = of_session.map(|entry| entry.number).collect();
        for number in numbers {
            self.cancel(number);
        }
    }

    /// The rig captures or moves, or rests.
    pub(super) fn set_rig_busy(&mut self, is_busy: bool) {
        self.is_rig_busy = is_busy;
    }

    /// What begins now, if anything does.
    pub(super) fn begin(&mut self) -> Option<StartedStep> {
        if self.is_rig_busy || self.current.is_some() {
            return None;
        }
        let entry = self.waiting.pop_front()?;
        let step = *entry.work.steps.first()?;
        let session = entry.work.session.clone();
        self.current = Some(UnderWay {
            entry,
            step,
            done: 0,
            of: 0,
            is_cancelled: false,
        });
        Some(StartedStep { session, step })
    }

    /// Whether the program under way is to be held.
    pub(super) fn should_pause(&self) -> bool {
        self.is_rig_busy && self.current.is_some() && !self.is_cancelled()
    }

    /// Whether the program under way is to end.
    pub(super) fn is_cancelled(&self) -> bool {
        let current = self.current.as_ref();
        current.is_some_and(|current| current.is_cancelled)
    }

    /// The program under way has come so far.
    pub(super) fn advance(&mut self, done: u64, of: u64) {
        if let Some(current) = &mut self.current {
            (current.done, current.of) = (done, of);
        }
    }

    /// The step under way has ended; returns how, as it is shown.
    pub(super) fn finish(&mut self, end: StepOutcome) -> String {
        let Some(UnderWay {
            mut entry,
            step,
            is_cancelled,
            ..
        }) = self.current.take()
        else {
            return end.what;
        };
        // What was done before the cancel arrived is done.
        let stopped = is_cancelled && end.outcome == ProcessingOutcome::Failed;
        let (outcome, what) = if stopped {
            (ProcessingOutcome::Cancelled, CANCELLED.to_owned())
        } else {
            (end.outcome, end.what)
        };
        self.remember(entry.clone(), step, outcome, &what);
        entry.work.steps.remove(0);
        if end.goes_on && !is_cancelled && !entry.work.steps.is_empty() {
            self.waiting.push_front(entry);
        }
        what
    }

    /// Forgets how masks of this session came out: a person has made another one.
    pub(super) fn forget_masks(&mut self, session: &str) {
        self.finished
            .retain(|job| job.session != session || job.step != ProcessingStep::Mask);
    }

    fn remember(
        &mut self,
        entry: Entry,
        step: ProcessingStep,
        outcome: ProcessingOutcome,
        what: &str,
    ) {
        if self.finished.len() == REMEMBERED {
            self.finished.pop_front();
        }
        self.finished.push_back(FinishedJob {
            number: entry.number,
            session: entry.work.session,
            step,
            outcome,
            what: what.to_owned(),
        });
    }

    /// What is under way and what waits, as it is shown.
    pub(super) fn jobs(&self) -> Vec<ProcessingJob> {
        let waiting = self.waiting.iter().filter_map(|entry| {
            let (&step, then) = entry.work.steps.split_first()?;
            Some(shown(entry, step, then, ProcessingStatus::Waiting))
        });
        let current = self.current.iter().map(|current| {
            let status = match (current.is_cancelled, self.is_rig_busy) {
                (true, _) => ProcessingStatus::Ending,
                (false, true) => ProcessingStatus::Held,
                (false, false) => ProcessingStatus::Running,
            };
            let then = current.entry.work.steps.get(1..).unwrap_or_default();
            ProcessingJob {
                done: current.done,
                of: current.of,
                ..shown(&current.entry, current.step, then, status)
            }
        });
        current.chain(waiting).collect()
    }

    /// The jobs that ended last, newest last.
    pub(super) fn finished(&self) -> Vec<FinishedJob> {
        self.finished.iter().cloned().collect()
    }
}

fn shown(
    entry: &Entry,
    step: ProcessingStep,
    then: &[ProcessingStep],
    status: ProcessingStatus,
) -> ProcessingJob {
    ProcessingJob {
        number: entry.number,
        session: entry.work.session.clone(),
        step,
        then: then.to_vec(),
        status,
        done: 0,
        of: 0,
    }
}

#[cfg(test)]
mod tests {
    use super::ProcessingStep::{Check, Extract, Mask};
    use super::*;

    fn work(session: &str, steps: &[ProcessingStep]) -> PendingWork {
        PendingWork {
            session: session.to_owned(),
            steps: steps.to_vec(),
        }
    }

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
        queue.submit(work("mug", &[Mask, Check, Extract])).unwrap();
        queue.submit(work("cow", &[Mask])).unwrap();
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
        queue.submit(work("mug", &[Check, Extract])).unwrap();
        queue.submit(work("cow", &[Mask])).unwrap();
        begun(&mut queue).unwrap();
        queue.finish(end(ProcessingOutcome::Doubtful, false));
        assert_eq!(begun(&mut queue), Some(("cow".to_owned(), Mask)));
    }

    #[test]
    fn nothing_begins_while_the_rig_is_busy_and_what_is_under_way_is_held() {
        let mut queue = ProcessingQueue::default();
        queue.set_rig_busy(true);
        queue.submit(work("mug", &[Mask, Check])).unwrap();
        assert_eq!(begun(&mut queue), None);
        assert!(!queue.should_pause(), "there is nothing to hold");
        queue.set_rig_busy(false);
        begun(&mut queue).unwrap();
        assert!(!queue.should_pause());
        queue.set_rig_busy(true);
        assert!(queue.should_pause());
        assert_eq!(queue.jobs()[0].status, ProcessingStatus::Held);
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
        let mug = queue.submit(work("mug", &[Mask, Check])).unwrap();
        let cow = queue.submit(work("cow", &[Mask])).unwrap();
        begun(&mut queue).unwrap();
        queue.set_rig_busy(true);
        assert!(queue.cancel(mug) && queue.cancel(cow));
        assert!(
            queue.is_cancelled() && !queue.should_pause(),
            "it has to run to end"
        );
        assert_eq!(queue.jobs().len(), 1);
        assert_eq!(queue.jobs()[0].status, ProcessingStatus::Ending);
        queue.finish(end(ProcessingOutcome::Failed, false));
        assert!(queue.jobs().is_empty() && !queue.cancel(mug));
        let outcomes: Vec<_> = queue.finished().iter().map(|job| job.outcome).collect();
        assert_eq!(outcomes, [ProcessingOutcome::Cancelled; 2]);
    }

    #[test]
    fn a_step_that_was_done_before_its_cancel_arrived_counts_as_done() {
        let mut queue = ProcessingQueue::default();
        let number = queue.submit(work("mug", &[Mask, Check])).unwrap();
        begun(&mut queue).unwrap();
        queue.cancel(number);
        queue.finish(end(GOOD, true));
        assert_eq!(queue.finished()[0].outcome, GOOD);
        assert_eq!(begun(&mut queue), None);
    }

    #[test]
    fn a_session_is_queued_once_and_again_after_its_end() {
        let mut queue = ProcessingQueue::default();
        queue.submit(work("mug", &[Mask])).unwrap();
        let again = queue.submit(work("mug", &[Check])).unwrap_err();
        assert!(
            matches!(&again, CommandError::Busy(why) if why.contains("mug")),
            "{again}"
        );
        begun(&mut queue).unwrap();
        assert!(queue.submit(work("mug", &[Check])).is_err());
        queue.finish(end(GOOD, true));
        queue.submit(work("mug", &[Check])).unwrap();
        let nothing = queue.submit(work("cow", &[]));
        assert!(
            matches!(nothing, Err(CommandError::Invalid(_))),
            "{nothing:?}"
        );
        queue.cancel_session("mug");
        assert!(queue.jobs().is_empty());
    }

    #[test]
    fn the_queue_has_an_end() {
        let mut queue = ProcessingQueue::default();
        for n in 0..MAX_WAITING {
            queue.submit(work(&n.to_string(), &[Mask])).unwrap();
        }
        let full = queue.submit(work("mug", &[Mask]));
        assert!(matches!(full, Err(CommandError::Busy(_))), "{full:?}");
    }
}
