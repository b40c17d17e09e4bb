//! One thread that carries bytes between port and supervisor, and waits on what comes of it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::error::TurntableError;
use super::port::Port;
use super::status::Status;
use super::supervisor::{Habits, StopOutcome, Supervisor};
use super::wire::{Outcome, Patience, SendError};
use crate::clock::Clock;

/// Longest wait for bytes before time and output are looked at again.
const READ_WAIT: Duration = Duration::from_millis(2);
/// Shortest such wait, however fast the clock runs.
const LEAST_WAIT: Duration = Duration::from_micros(200);
/// How long a report may take.
const REPORT_WAIT: Duration = Duration::from_millis(1500);
/// How long a stop may take, with all its repetitions.
const STOP_WAIT: Duration = Duration::from_secs(16);
/// How long a thread may have to wait for a processor, in real time.
const PAUSE: Duration = Duration::from_millis(300);
/// What is added in real time to every wait: a line's five tries may each meet such a pause.
const GRACE: Duration = Duration::from_millis(1500);

/// The wire to a table with its thread; copies share both.
#[derive(Clone)]
pub(super) struct Link {
    shared: Arc<Shared>,
    clock: Clock,
}

struct Shared {
    supervisor: Mutex<Supervisor>,
    changed: Condvar,
    quit: AtomicBool,
    name: String,
}

/// Ends the link's thread, and so closes the port, when it is dropped.
pub(super) struct Carrier {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for Carrier {
    fn drop(&mut self) {
        self.shared.quit.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A thread that has panicked has closed the port as well.
            let _ = thread.join();
        }
    }
}

impl Link {
    /// Starts the thread.
    pub(super) fn start(port: Box<dyn Port>, clock: Clock, habits: Habits) -> (Link, Carrier) {
        let shared = Arc::new(Shared {
            supervisor: Mutex::new(Supervisor::new(habits, slack_us(&clock))),
            changed: Condvar::new(),
            quit: AtomicBool::new(false),
            name: port.name(),
        });
        let carried = Arc::clone(&shared);
        let carries = clock.clone();
        let thread = thread::spawn(move || carry(port, &carried, carries));
        let carrier = Carrier {
            shared: Arc::clone(&shared),
            thread: Some(thread),
        };
        (Link { shared, clock }, carrier)
    }

    pub(super) fn clock(&self) -> Clock {
        self.clock.clone()
    }

    pub(super) fn port_name(&self) -> &str {
        &self.shared.name
    }

    /// The supervisor, for a moment.
    pub(super) fn supervisor(&self) -> MutexGuard<'_, Supervisor> {
        self.shared.lock()
    }

    /// Looks at the supervisor after each change until `look` finds something, or until `limit`
    /// of the table's clock is over.
    pub(super) fn wait<T>(
        &self,
        limit: Duration,
        mut look: impl FnMut(&mut Supervisor) -> Option<T>,
    ) -> Option<T> {
        let until = Instant::now() + self.clock.real(limit) + GRACE;
        let mut supervisor = self.shared.lock();
        loop {
            if let Some(found) = look(&mut supervisor) {
                return Some(found);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            let waited = self.shared.changed.wait_timeout(supervisor, left);
            supervisor = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Sends a line and waits for its answer.
    pub(super) fn line(&self, block: &str, patience: Patience) -> Result<Outcome, TurntableError> {
        let now_us = self.clock.now_us();
        let sent = self.supervisor().send(now_us, block, patience);
        self.answer(block, sent, patience)
    }

    /// Opens a checked session.
    pub(super) fn open_session(&self) -> Result<Outcome, TurntableError> {
        let now_us = self.clock.now_us();
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
            Patience::Short => Duration::from_secs(4),
            Patience::Long(us) => Duration::from_micros(us.unsigned_abs()) + GRACE,
        };
        let outcome = self.wait(limit, |supervisor| {
            let lost = || supervisor_lost(supervisor);
            lost().map_or_else(
                || supervisor.take_answer(id).map(Ok),
                |error| Some(Err(error)),
            )
        });
        outcome.unwrap_or(Err(TurntableError::Silent {
            milliseconds: limit.as_millis() as u64,
        }))
    }

    /// The table's state by a report that was asked for just now, and by one more where they have
    /// no checksum.
    pub(super) fn status(&self) -> Result<Status, TurntableError> {
        let asked_us = self.clock.now_us();
        let until_us = asked_us + REPORT_WAIT.as_micros() as i64;
        self.supervisor().want_reports(until_us);
        let status = self.wait(REPORT_WAIT, |supervisor| {
            if let Some(error) = supervisor_lost(supervisor) {
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
        self.supervisor().request_stop(self.clock.now_us());
        self.wait_stopped()?;
        self.status()
    }

    /// Waits until a stop under way has ended.
    pub(super) fn wait_stopped(&self) -> Result<(), TurntableError> {
        let ended = self.wait(STOP_WAIT, |supervisor| match supervisor_lost(supervisor) {
            Some(error) => Some(Err(error)),
            None => supervisor.stopped().map(Ok),
        });
        match ended.transpose()? {
            Some(StopOutcome::Standing | StopOutcome::Displaced) => Ok(()),
            Some(StopOutcome::Unknown) | None => Err(TurntableError::NotStopped),
        }
    }
}

fn supervisor_lost(supervisor: &Supervisor) -> Option<TurntableError> {
    let why = supervisor.closed()?;
    Some(super::error::Fault::PortLost(why.to_owned()).into())
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Supervisor> {
        self.supervisor
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
    }
}

/// What a wait of a fast clock has to allow for: threads run no faster for it. Microseconds.
fn slack_us(clock: &Clock) -> i64 {
    ((clock.factor() - 1.0).max(0.0) * PAUSE.as_micros() as f64) as i64
}

/// The thread: what is due goes out, what comes is taken, until the link is dropped or the port
/// is gone.
fn carry(mut port: Box<dyn Port>, shared: &Shared, clock: Clock) {
    let wait = clock.real(READ_WAIT).clamp(LEAST_WAIT, READ_WAIT);
    let mut buffer = [0; 512];
    while !shared.quit.load(Ordering::Acquire) {
        let output = shared.lock().take_output(clock.now_us());
        let written = port.write(&output);
        let asked_us = clock.now_us();
        let read = written.and_then(|()| port.read(&mut buffer, wait));
        let now_us = clock.now_us();
        let mut supervisor = shared.lock();
        match read {
            // Nothing had come by the time the port was asked. What came later, while this thread
            // perhaps had to wait for a processor, is no silence.
            Ok(0) => supervisor.on_time(asked_us),
            Ok(count) => supervisor.on_bytes(now_us, buffer.get(..count).unwrap_or_default()),
            Err(error) => supervisor.close(error.to_string()),
        }
        let gone = supervisor.closed().is_some();
        drop(supervisor);
        shared.changed.notify_all();
        if gone {
            return;
        }
    }
}
