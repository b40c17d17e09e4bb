//! The one thread that carries bytes between port and supervisor, and the waits for what comes of
//! it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, MutexGuard};
use std::time::Duration;

use super::error::{Fault, TurntableError};
use super::port::Port;
use super::status::Status;
use super::supervisor::{Habits, StopOutcome, Supervisor};
use super::wire::{Outcome, Patience, SendError};
use crate::clock::{Clock, JoinHandle, Waitable};

/// Longest wait for bytes before time and output are looked at again.
const READ_WAIT: Duration = Duration::from_millis(2);
/// How long a report may take; a loaded host keeps its thread from running for a part of it.
const REPORT_WAIT: Duration = Duration::from_secs(3);
/// How long a line's answer may take at most, with all repetitions. The wire gives up sooner.
const ANSWER_WAIT: Duration = Duration::from_secs(6);
/// What is added to it for a line that is answered after something else has happened.
const LATE_ANSWER: Duration = Duration::from_secs(2);
/// How long a stop may take, with all its repetitions.
const STOP_WAIT: Duration = Duration::from_secs(16);

/// The wire to a table with its thread; copies share both.
#[derive(Clone)]
pub(super) struct Link {
    supervisor: Arc<Waitable<Supervisor>>,
    port_name: Arc<str>,
}

/// The thread that has the port. Dropped, it ends, and so closes the port.
pub(super) struct IoThread {
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for IoThread {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has closed the port as well.
            let _ = thread.join();
        }
    }
}

impl Link {
    /// Starts the thread.
    pub(super) fn start(
        port: Box<dyn Port>,
        clock: &Clock,
        habits: Habits,
    ) -> Result<(Link, IoThread), TurntableError> {
        let link = Link {
            port_name: port.name().into(),
            supervisor: Arc::new(Waitable::new(clock, Supervisor::new(habits))),
        };
        let quit = Arc::new(AtomicBool::new(false));
        let thread = clock.spawn("turntable", {
            let (supervisor, quit) = (Arc::clone(&link.supervisor), Arc::clone(&quit));
            move || carry(port, &supervisor, &quit)
        });
        let thread = Some(thread.map_err(TurntableError::Thread)?);
        Ok((link, IoThread { quit, thread }))
    }

    pub(super) fn clock(&self) -> &Clock {
        self.supervisor.clock()
    }

    pub(super) fn port_name(&self) -> &str {
        &self.port_name
    }

    /// The supervisor, for a moment.
    pub(super) fn supervisor(&self) -> MutexGuard<'_, Supervisor> {
        self.supervisor.lock()
    }

    /// Looks at the supervisor after each change until `look` finds something, or until `limit`
    /// of the table's clock is over.
    pub(super) fn wait<T>(
        &self,
        limit: Duration,
        look: impl FnMut(&mut Supervisor) -> Option<T>,
    ) -> Option<T> {
        self.supervisor.wait_for(limit, look)
    }

    /// Sends a line and waits for its answer.
    pub(super) fn line(&self, block: &str, patience: Patience) -> Result<Outcome, TurntableError> {
        let now_us = self.clock().now_us();
        let sent = self.supervisor().send(now_us, block, patience);
        self.answer(block, sent, patience)
    }

    /// Opens a checked session.
    pub(super) fn open_session(&self) -> Result<Outcome, TurntableError> {
        let now_us = self.clock().now_us();
        let sent = self.supervisor().open_session(now_us);
        self.answer("N0", sent, Patience::Short)
    }

    fn answer(
        &self,
        block: &str,
        sent: Result<u64, SendError>,
        patience: Patience,
    ) -> Result<Outcome, TurntableError> {
        let id = sent.map_err(|why| TurntableError::Unsent {
            block: block.to_owned(),
            why,
        })?;
        let limit = match patience {
            Patience::Short => ANSWER_WAIT,
            Patience::Long(us) => Duration::from_micros(us.unsigned_abs()) + LATE_ANSWER,
        };
        let outcome = self.wait(limit, |supervisor| match port_lost(supervisor) {
            Some(error) => Some(Err(error)),
            None => supervisor.take_answer(id).map(Ok),
        });
        outcome.unwrap_or(Err(TurntableError::Silent {
            milliseconds: limit.as_millis() as u64,
        }))
    }

    /// The table's state by a report that was asked for just now, and by one more where they have
    /// no checksum.
    pub(super) fn status(&self) -> Result<Status, TurntableError> {
        let asked_us = self.clock().now_us();
        let until_us = self.clock().after(REPORT_WAIT);
        self.supervisor().want_reports(until_us);
        let status = self.wait(REPORT_WAIT, |supervisor| {
            if let Some(error) = port_lost(supervisor) {
                return Some(Err(error));
            }
            let seen = supervisor.seen()?;
            let fresh = seen.asked_us.is_some_and(|us| us >= asked_us);
            (fresh && supervisor.is_confirmed()).then(|| Ok(Status::of(seen, supervisor)))
        });
        status.unwrap_or(Err(TurntableError::Silent {
            milliseconds: REPORT_WAIT.as_millis() as u64,
        }))
    }

    /// Brings the table to a standstill, and drops what it was still to do.
    pub(super) fn stop(&self) -> Result<Status, TurntableError> {
        let now_us = self.clock().now_us();
        self.supervisor().request_stop(now_us);
        self.wait_stopped()?;
        self.status()
    }

    /// Waits until a stop under way has ended.
    pub(super) fn wait_stopped(&self) -> Result<(), TurntableError> {
        let ended = self.wait(STOP_WAIT, |supervisor| match port_lost(supervisor) {
            Some(error) => Some(Err(error)),
            None => supervisor.stopped().map(Ok),
        });
        match ended.transpose()? {
            Some(StopOutcome::Standing | StopOutcome::Displaced) => Ok(()),
            Some(StopOutcome::Unknown) | None => Err(TurntableError::NotStopped),
        }
    }
}

fn port_lost(supervisor: &Supervisor) -> Option<TurntableError> {
    let why = supervisor.closed()?;
    Some(Fault::PortLost(why.to_owned()).into())
}

/// The thread: what is due goes out, what comes is taken, until it is to end or the port is gone.
fn carry(mut port: Box<dyn Port>, shared: &Waitable<Supervisor>, quit: &AtomicBool) {
    let clock = shared.clock();
    let mut buffer = [0; 512];
    while !quit.load(Ordering::Acquire) {
        let output = shared.lock().take_output(clock.now_us());
        let written = port.write(&output);
        let asked_us = clock.now_us();
        let read = written.and_then(|()| port.read(&mut buffer, READ_WAIT));
        let now_us = clock.now_us();
        let mut supervisor = shared.lock();
        match read {
            // Nothing had come by the time the port was asked. What came later, while this thread
            // perhaps had to wait for a processor, is no silence.
            Ok(0) => supervisor.on_time(asked_us),
            Ok(count) => supervisor.on_bytes(now_us, buffer.get(..count).unwrap_or_default()),
            Err(error) => supervisor.close(error.to_string()),
        }
        let (changed, gone) = (supervisor.take_changed(), supervisor.closed().is_some());
        drop(supervisor);
        if changed {
            shared.notify();
        }
        if gone {
            return;
        }
    }
}
