//! What the rig does, and what comes next: the queue of objects, the job under way and its stop, as
//! one state machine.
//!
//! It has no threads, no clock and no devices. Commands change it in any order; one worker asks for
//! the [next](Schedule::begin) job and reports how it [ended](Schedule::finish).
//!
//! ```text
//! free --submit--> waiting --begin--> under way --finish--> free
//!   stop: of a free or waiting rig, stopping the table becomes the job; a job under way is stopped
//! ```
//!
//! An object leaves the queue when its capture succeeded, or when somebody takes it out. A stop ends
//! with the job that it was meant for.

use std::collections::VecDeque;

use crate::command::Refused;
use crate::state::CaptureSettings;

/// Objects that can wait for their turn.
const LONGEST_QUEUE: usize = 100;

/// Something for the rig to do.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Job {
    /// One turn of an object, after a metering turn if `meter`.
    Capture {
        object: String,
        meter: bool,
    },
    /// Whatever the table does.
    StopTable,
    Home,
    /// By degrees.
    Jog(f64),
    Unlock,
    /// Resets, unlocks and homes the table.
    ResetTable,
    Configure(CaptureSettings),
    SetControl {
        name: String,
        value: i64,
    },
}

/// What the worker does now.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Next {
    /// Nothing is to be done.
    Idle,
    /// This job.
    Job(Job),
    /// No more jobs come.
    End,
}

/// Where a stop goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum StopTarget {
    /// To the job under way: its stop has to be asked for.
    Running,
    /// Nowhere else: it is the next job, or nothing is left to stop.
    Settled,
}

/// An object in the queue. Its number distinguishes it from others of the same name.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Entry {
    number: u64,
    object: String,
}

#[derive(Debug, Clone, PartialEq)]
struct Current {
    job: Job,
    /// The entry of the queue that is captured.
    entry: Option<u64>,
    is_running: bool,
}

/// Queue, job and stop of one rig.
#[derive(Debug, Default)]
pub(super) struct Schedule {
    queue: VecDeque<Entry>,
    /// Entries so far.
    entries: u64,
    current: Option<Current>,
    is_ending: bool,
}

impl Schedule {
    /// The objects that are to be captured, next first; one that is just being captured is still
    /// among them.
    pub(super) fn queue(&self) -> Vec<String> {
        let objects = self.queue.iter().map(|entry| entry.object.clone());
        objects.collect()
    }

    /// Whether nothing is under way or about to begin.
    pub(super) fn is_free(&self) -> bool {
        self.current.is_none()
    }

    /// Appends an object.
    pub(super) fn enqueue(&mut self, object: String) -> Result<(), Refused> {
        if self.queue.len() >= LONGEST_QUEUE {
            let full = format!("{LONGEST_QUEUE} objects are queued already");
            return Err(Refused::Invalid(full));
        }
        self.entries += 1;
        self.queue.push_back(Entry {
            number: self.entries,
            object,
        });
        Ok(())
    }

    /// Takes the object at `place`, 0 is next, out of the queue: only where it is `expected`, if that
    /// is given. A capture of it that is under way goes on.
    pub(super) fn dequeue(&mut self, place: usize, expected: Option<&str>) -> Result<(), Refused> {
        let none = || Refused::Invalid(format!("the queue has no place {place}"));
        let entry = self.queue.get(place).ok_or_else(none)?;
        check_expected(entry, expected)?;
        self.queue.remove(place);
        Ok(())
    }

    /// Makes the next object's capture the job: only where it is `expected`, if that is given.
    pub(super) fn submit_next(&mut self, expected: Option<&str>) -> Result<(), Refused> {
        let none = || Refused::Invalid("no object is queued".to_owned());
        let entry = self.queue.front().ok_or_else(none)?.clone();
        check_expected(&entry, expected)?;
        let capture = Job::Capture {
            object: entry.object,
            meter: false,
        };
        self.make_current(capture, Some(entry.number))
    }

    /// Makes this the job, where there is none.
    pub(super) fn submit(&mut self, job: Job) -> Result<(), Refused> {
        self.make_current(job, None)
    }

    fn make_current(&mut self, job: Job, entry: Option<u64>) -> Result<(), Refused> {
        if self.is_ending {
            let ending = "the rig is about to end: start the program again";
            return Err(Refused::Unavailable(ending.to_owned()));
        }
        if let Some(current) = &self.current {
            return Err(Refused::Busy(under_way(&current.job)));
        }
        self.current = Some(Current {
            job,
            entry,
            is_running: false,
        });
        Ok(())
    }

    /// Stops what is under way; a job that has not begun does not begin. Where there is neither, the
    /// table is stopped all the same: it may move on its own account.
    pub(super) fn stop(&mut self) -> StopTarget {
        match &mut self.current {
            _ if self.is_ending => StopTarget::Settled,
            Some(current) if current.is_running => match current.job {
                Job::StopTable => StopTarget::Settled,
                _ => StopTarget::Running,
            },
            other => {
                *other = Some(Current {
                    job: Job::StopTable,
                    entry: None,
                    is_running: false,
                });
                StopTarget::Settled
            }
        }
    }

    /// Takes no more jobs; one under way goes on until its stop is asked for.
    pub(super) fn end(&mut self) {
        self.is_ending = true;
    }

    /// What the worker does now.
    pub(super) fn begin(&mut self) -> Next {
        match &mut self.current {
            _ if self.is_ending => Next::End,
            Some(current) if !current.is_running => {
                current.is_running = true;
                Next::Job(current.job.clone())
            }
            _ => Next::Idle,
        }
    }

    /// The job is over. After a success, what it captured leaves the queue.
    pub(super) fn finish(&mut self, succeeded: bool) {
        let done = self.current.take().and_then(|current| current.entry);
        if let Some(number) = done.filter(|_| succeeded) {
            self.queue.retain(|entry| entry.number != number);
        }
    }
}

fn check_expected(entry: &Entry, expected: Option<&str>) -> Result<(), Refused> {
    match expected {
        Some(expected) if expected != entry.object => Err(Refused::Busy(format!(
            "the queue has changed: {} is there now, not {expected}; check the queue and try again",
            entry.object
        ))),
        _ => Ok(()),
    }
}

fn under_way(job: &Job) -> String {
    match job {
        Job::Capture { object, .. } => {
            format!("{object} is being captured: wait for it, or stop it")
        }
        _ => "the table or the camera is being set: wait a moment".to_owned(),
    }
}

#[cfg(test)]
mod tests;
