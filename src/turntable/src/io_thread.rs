//! The I/O thread between port and supervisor, and the waits for its results.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, MutexGuard};
use std::time::Duration;

use relit_data::causes::with_causes;

use super::error::TurntableError;
use super::port::Port;
use super::protocol::{LineOutcome, ReplyTimeout, SendError};
use super::status::TableStatus;
use super::supervisor::{ControllerFeatures, MotionFault, StopOutcome, Supervisor};
use relit_data::clock::{Clock, JoinHandle, Waitable};

/// Longest wait for bytes until the next check of time and output.
const READ_WAIT: Duration = Duration::from_millis(2);
/// How long a report may take, including pauses of the I/O thread on a loaded machine.
const REPORT_WAIT: Duration = Duration::from_secs(3);
/// How long a line's answer may take, including all repetitions. The protocol normally gives up
/// earlier.
const ANSWER_WAIT: Duration = Duration::from_secs(6);
/// Added to the time limit of a line that is not answered at once.
const LATE_ANSWER: Duration = Duration::from_secs(2);
/// How long a stop may take, including all repetitions.
const STOP_WAIT: Duration = Duration::from_secs(16);

/// The connection to a table. Clones share it.
#[derive(Clone)]
pub(super) struct Connection {
    supervisor: Arc<Waitable<Supervisor>>,
    port_name: Arc<str>,
}

/// The thread that owns the port. Dropping it ends the thread and closes the port.
pub(super) struct IoThread {
    quit: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Drop for IoThread {
    fn drop(&mut self) {
        self.quit.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // If the thread has panicked, the port is closed as well.
            let _ = thread.join();
        }
    }
}

impl Connection {
    /// Starts the thread.
    pub(super) fn start(
        port: Box<dyn Port>,
        clock: &Clock,
        traits: ControllerFeatures,
    ) -> Result<(Connection, IoThread), TurntableError> {
        let connection = Connection {
            port_name: port.name().into(),
            supervisor: Arc::new(Waitable::new(clock, Supervisor::new(traits))),
        };
        let quit = Arc::new(AtomicBool::new(false));
        let thread = clock.spawn("turntable", {
            let (supervisor, quit) = (Arc::clone(&connection.supervisor), Arc::clone(&quit));
            move || carry(port, &supervisor, &quit)
        });
        let thread = Some(thread.map_err(|source| TurntableError::Open {
            path: connection.port_name().into(),
            source,
        })?);
        Ok((connection, IoThread { quit, thread }))
    }

    pub(super) fn clock(&self) -> &Clock {
        self.supervisor.clock()
    }

    pub(super) fn port_name(&self) -> &str {
        &self.port_name
    }

    /// Locks the supervisor.
    pub(super) fn supervisor(&self) -> MutexGuard<'_, Supervisor> {
        self.supervisor.lock()
    }

    /// Calls `look` now and after each change until it returns something; `None` after `limit`.
    pub(super) fn wait<T>(
        &self,
        limit: Duration,
        look: impl FnMut(&mut Supervisor) -> Option<T>,
    ) -> Option<T> {
        self.supervisor.wait_for(limit, look)
    }

    /// Sends a line and waits for its answer.
    pub(super) fn line(
        &self,
        block: &str,
        timeout: ReplyTimeout,
    ) -> Result<LineOutcome, TurntableError> {
        let now_us = self.clock().now_us();
        let sent = self.supervisor().send(now_us, block, timeout);
        self.answer(block, sent, timeout)
    }

    /// Opens a checked session.
    pub(super) fn open_session(&self) -> Result<LineOutcome, TurntableError> {
        let now_us = self.clock().now_us();
        let sent = self.supervisor().open_session(now_us);
        self.answer("N0", sent, ReplyTimeout::AtOnce)
    }

    fn answer(
        &self,
        block: &str,
        sent: Result<u64, SendError>,
        timeout: ReplyTimeout,
    ) -> Result<LineOutcome, TurntableError> {
        let id = sent.map_err(|why| TurntableError::Unsent {
            block: block.to_owned(),
            why,
        })?;
        let limit = match timeout {
            ReplyTimeout::AtOnce => ANSWER_WAIT,
            ReplyTimeout::Within(us) => Duration::from_micros(us.unsigned_abs()) + LATE_ANSWER,
        };
        let outcome = self.wait(limit, |supervisor| match port_lost(supervisor) {
            Some(error) => Some(Err(error)),
            None => supervisor.take_answer(id).map(Ok),
        });
        outcome.unwrap_or_else(|| Err(TurntableError::silent(limit)))
    }

    /// The table's status by a report that is requested now; without checksums, confirmed by a
    /// second one.
    pub(super) fn status(&self) -> Result<TableStatus, TurntableError> {
        let asked_us = self.clock().now_us();
        let until_us = self.clock().after(REPORT_WAIT);
        self.supervisor().want_reports(until_us);
        let status = self.wait(REPORT_WAIT, |supervisor| {
            if let Some(error) = port_lost(supervisor) {
                return Some(Err(error));
            }
            let report = supervisor.last_report()?;
            let fresh = report.asked_us.is_some_and(|us| us >= asked_us);
            (fresh && supervisor.is_confirmed()).then(|| Ok(TableStatus::new(report, supervisor)))
        });
        status.unwrap_or_else(|| Err(TurntableError::silent(REPORT_WAIT)))
    }

    /// Brings the table to a standstill and discards its remaining motions.
    pub(super) fn stop(&self) -> Result<TableStatus, TurntableError> {
        let now_us = self.clock().now_us();
        self.supervisor().request_stop(now_us);
        self.wait_stopped()?;
        self.status()
    }

    /// The same, and resets the controller as soon as the table stands.
    pub(super) fn reset(&self) -> Result<TableStatus, TurntableError> {
        if self.supervisor().is_stopping() {
            self.wait_stopped()?;
        }
        let now_us = self.clock().now_us();
        self.supervisor().request_reset(now_us);
        self.wait_stopped()?;
        self.status()
    }

    /// Waits for the end of a stop.
    pub(super) fn wait_stopped(&self) -> Result<(), TurntableError> {
        let ended = self.wait(STOP_WAIT, |supervisor| match port_lost(supervisor) {
            Some(error) => Some(Err(error)),
            None => supervisor.stopped().map(Ok),
        });
        match ended.transpose()? {
            Some(StopOutcome::Stopped | StopOutcome::Displaced) => Ok(()),
            Some(StopOutcome::Unknown) | None => Err(TurntableError::NotStopped),
        }
    }
}

fn port_lost(supervisor: &Supervisor) -> Option<TurntableError> {
    let why = supervisor.closed()?;
    Some(MotionFault::PortLost(why.to_owned()).into())
}

/// The I/O thread: sends what is due and reads what comes, until `quit` is set or the port is gone.
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
            // The time at which the read began: this thread may have been paused since, and bytes
            // that arrived during the pause must not count as silence.
            Ok(0) => supervisor.on_time(asked_us),
            Ok(count) => {
                supervisor.on_bytes(now_us, buffer.get(..count).unwrap_or_default());
                // Noise on the line must not keep the waiting for answers from ending.
                if count < buffer.len() {
                    supervisor.on_time(asked_us);
                }
            }
            Err(error) => supervisor.close(with_causes(&error)),
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
