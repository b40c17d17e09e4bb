//! The table as other modules use it.

use std::path::Path;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

use super::TableOptions;
use super::codes::Alarm;
use super::error::TurntableError;
use super::handshake;
use super::identity::Identity;
use super::io_thread::{Connection, IoThread};
use super::port::{self, Port, SerialPort};
use super::protocol::{ControllerState, Counts, LineOutcome, Message, ReplyTimeout};
use super::status::TableStatus;
use super::supervisor::{MotionFault, MotionGoal};
use relit_data::clock::Clock;

/// Added to the computed time of a motion.
const MOTION_SLACK: Duration = Duration::from_secs(4);
/// How long a program that was asked to end may take, which stops its table first, and the pause between two looks.
const TAKE_OVER: Duration = Duration::from_secs(25);
const LOOK: Duration = Duration::from_millis(100);
/// Speed limit of unwinding, and of jogs without a given speed, degrees/s.
const BRISK: f64 = 30.0;

/// A table, owned by this process. Dropping it stops the table.
pub struct Table {
    connection: Connection,
    _io_thread: IoThread,
    identity: Identity,
    was_stopped: bool,
}

impl Table {
    /// Takes over the controller behind `port`: waits until it has started, stops it if it moves,
    /// and reads its identity and settings.
    ///
    /// # Errors
    /// [`TurntableError::Failed`], or what else failed during the exchange.
    pub fn open(port: impl Port, options: &TableOptions) -> Result<Table, TurntableError> {
        let resets = port.resets();
        let unknown = handshake::unknown_controller();
        let (connection, io_thread) = Connection::start(Box::new(port), &options.clock, unknown)?;
        let (identity, was_stopped) = handshake::run(&connection, resets, options)?;
        Ok(Table {
            connection,
            _io_thread: io_thread,
            identity,
            was_stopped,
        })
    }

    /// Opens a serial port exclusively.
    ///
    /// # Errors
    /// [`TurntableError::Owned`] if another process has it, and the errors of [`Table::open`].
    pub fn open_serial(path: &Path, options: &TableOptions) -> Result<Table, TurntableError> {
        Self::open(SerialPort::open(path)?, options)
    }

    /// The same, and ends a program of the toolkit that has the port, which stops its table then.
    ///
    /// # Errors
    /// [`TurntableError::Owned`] if that one may not be ended or does not end, and the errors of [`Table::open`].
    pub fn take_over(path: &Path, options: &TableOptions) -> Result<Table, TurntableError> {
        let until_us = options.clock.after(TAKE_OVER);
        let mut is_asked = false;
        loop {
            let (pid, error) = match Self::open_serial(path, options) {
                Err(error @ TurntableError::Owned { pid, .. }) => (pid, error),
                opened => return opened,
            };
            if !is_asked && let Some(pid) = pid.filter(|&pid| port::is_ours(pid)) {
                let pid = i32::try_from(pid).ok().and_then(Pid::from_raw);
                is_asked = pid.is_some_and(|pid| kill_process(pid, Signal::TERM).is_ok());
            }
            if !is_asked || options.clock.now_us() > until_us {
                return Err(error);
            }
            options.clock.sleep(LOOK);
        }
    }

    /// The controller's identity and settings.
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// Whether the table was moving when it was opened, and had to be stopped: nobody had it.
    pub fn was_stopped(&self) -> bool {
        self.was_stopped
    }

    /// Counters of lines, reports and line errors since the table was opened.
    pub fn counts(&self) -> Counts {
        self.connection.supervisor().counts()
    }

    pub(super) fn clock(&self) -> &Clock {
        self.connection.clock()
    }

    pub(super) fn connection(&self) -> &Connection {
        &self.connection
    }

    /// The table's present status.
    ///
    /// # Errors
    /// [`TurntableError::Failed`].
    pub fn status(&self) -> Result<TableStatus, TurntableError> {
        self.connection.status()
    }

    /// The range in which the table may turn, degrees from the angle 0.
    pub fn limits(&self, status: &TableStatus) -> (f64, f64) {
        self.identity.limits_from(status)
    }

    /// Turns by `degrees` and waits until the table has arrived. `speed` in degrees/s; without it,
    /// at most 30.
    ///
    /// # Errors
    /// [`TurntableError::Failed`], [`TurntableError::NotReady`], or what ended the motion.
    pub fn jog(&self, degrees: f64, speed: Option<f64>) -> Result<TableStatus, TurntableError> {
        let speed = speed.unwrap_or_else(|| self.default_speed());
        self.identity.check_speed(speed)?;
        if !degrees.is_finite() {
            return Err(TurntableError::OutOfRange {
                what: "the angle in degrees",
                value: degrees,
                range: "it has to be a number".to_owned(),
            });
        }
        let status = self.ready()?;
        let (low_deg, high_deg) = self.identity.limits_from(&status);
        let target_deg = status.angle_deg + degrees;
        if !(low_deg..=high_deg).contains(&target_deg) {
            return Err(TurntableError::Failed(format!(
                "{target_deg:.3} degrees is beyond the limits {low_deg:.3} to {high_deg:.3}: go there the other way round, so that the cable unwinds"
            )));
        }
        let machine_deg = status.machine_deg + degrees;
        // An absolute target: a line that is executed twice still moves the table once.
        let block = format!("$J=G21G90G53X{machine_deg:.3}F{:.3}", speed * 60.0);
        self.travel(&block, &status, machine_deg, speed)?;
        self.status()
    }

    /// Speed of unwinding, and of jogs without a given speed, degrees/s.
    pub(super) fn default_speed(&self) -> f64 {
        self.identity.max_degrees_per_second.min(BRISK)
    }

    /// Moves to `machine_deg`, degrees from machine zero, and waits until the table has arrived. That
    /// place was computed while the angle 0 was at `zero_deg`.
    pub(super) fn go(
        &self,
        machine_deg: f64,
        speed: f64,
        zero_deg: f64,
    ) -> Result<(), TurntableError> {
        let status = self.ready()?;
        self.require_zero(zero_deg)?;
        let block = straight(machine_deg, speed);
        self.travel(&block, &status, machine_deg, speed)
    }

    /// Checks that the angle 0 is still known to be at `zero_deg`: a controller that has restarted
    /// counts from another place.
    pub(super) fn require_zero(&self, zero_deg: f64) -> Result<(), TurntableError> {
        let supervisor = self.connection.supervisor();
        match supervisor.zero_deg() {
            Some(known) if known == zero_deg => Ok(()),
            None if supervisor.has_restarted() => Err(MotionFault::Restarted(None).into()),
            _ => Err(TurntableError::NotHomed),
        }
    }

    fn travel(
        &self,
        block: &str,
        from: &TableStatus,
        machine_deg: f64,
        speed: f64,
    ) -> Result<(), TurntableError> {
        let distance = (machine_deg - from.machine_deg).abs();
        self.launch(block, machine_deg, distance, speed)?;
        let arrived = self.wait_arrival(self.travel_time(distance, speed));
        self.connection.supervisor().end_motion();
        arrived
    }

    /// Time limit of a motion.
    pub(super) fn travel_time(&self, distance_deg: f64, speed: f64) -> Duration {
        let ramps = speed / self.identity.acceleration;
        Duration::try_from_secs_f64((distance_deg / speed + ramps) * 1.05)
            .unwrap_or(Duration::MAX / 4)
            .saturating_add(MOTION_SLACK)
    }

    /// Sends the line that moves the table and starts to monitor the motion.
    pub(super) fn launch(
        &self,
        block: &str,
        target_deg: f64,
        distance: f64,
        speed: f64,
    ) -> Result<(), TurntableError> {
        let time = self.travel_time(distance, speed);
        self.begin(MotionGoal::To {
            target_deg,
            within_us: i64::try_from(time.as_micros()).unwrap_or(i64::MAX),
        })?;
        let sent = self.command(block);
        let mut supervisor = self.connection.supervisor();
        match sent {
            Ok(_) => supervisor.motion_accepted(self.clock().now_us()),
            Err(_) => supervisor.end_motion(),
        }
        sent.map(|_| ())
    }

    /// Waits until the table is at its target or a fault has stopped it.
    pub(super) fn wait_arrival(&self, limit: Duration) -> Result<(), TurntableError> {
        let ended = self.connection.wait(limit + MOTION_SLACK, |supervisor| {
            let arrived = supervisor
                .motion()
                .is_some_and(|motion| motion.is_at_target());
            (arrived || supervisor.fault().is_some()).then_some(())
        });
        match self.end_by_fault()? {
            Some(fault) => Err(fault),
            None if ended.is_none() => {
                self.stop()?;
                Err(MotionFault::Late.into())
            }
            None => Ok(()),
        }
    }

    /// The fault that has ended the motion, if any. Waits until the table has been stopped.
    pub(super) fn end_by_fault(&self) -> Result<Option<TurntableError>, TurntableError> {
        let fault = self.connection.supervisor().fault().cloned();
        if let Some(fault) = fault {
            let gone = self.connection.supervisor().closed().is_some();
            if !gone {
                self.connection.wait_stopped()?;
            }
            return Ok(Some(fault.into()));
        }
        Ok(None)
    }

    /// Starts to monitor a motion.
    ///
    /// # Errors
    /// [`TurntableError::Busy`] if one is in progress.
    pub(super) fn begin(&self, goal: MotionGoal) -> Result<(), TurntableError> {
        self.ensure_checked_session()?;
        let mut supervisor = self.connection.supervisor();
        if supervisor.is_stopping() || supervisor.motion().is_some() {
            return Err(TurntableError::Busy);
        }
        supervisor.begin_motion(self.clock().now_us(), goal);
        Ok(())
    }

    /// The status of a table that is ready for a motion.
    pub(super) fn ready(&self) -> Result<TableStatus, TurntableError> {
        let status = self.status()?;
        require_released(&status)?;
        let supervisor = self.connection.supervisor();
        if supervisor.is_stopping() || supervisor.motion().is_some() {
            return Err(TurntableError::Busy);
        }
        match status.state {
            ControllerState::Idle => Ok(status),
            state => Err(TurntableError::NotReady {
                state,
                alarm: status.alarm,
            }),
        }
    }

    /// Ramps the table down, discards its remaining motions, and verifies that it stands.
    ///
    /// # Errors
    /// [`TurntableError::NotStopped`] if it was not reported at rest.
    pub fn stop(&self) -> Result<TableStatus, TurntableError> {
        self.connection.stop()
    }

    /// Unlocks the table after an alarm. A controller that refuses that, as after an emergency stop, is
    /// reset first.
    ///
    /// # Errors
    /// [`TurntableError::EmergencyStop`] while it is pressed.
    pub fn unlock(&self) -> Result<TableStatus, TurntableError> {
        self.clear_emergency_stop()?;
        if let Err(refused) = self.command("$X") {
            self.unlock_after_reset(refused)?;
        }
        let status = self.status()?;
        let still_locked = status.alarm.is_some_and(Alarm::is_emergency_stop);
        if still_locked {
            Err(TurntableError::EmergencyStop)
        } else {
            Ok(status)
        }
    }

    fn unlock_after_reset(&self, refused: TurntableError) -> Result<(), TurntableError> {
        let locked = self.status()?.state == ControllerState::Alarm;
        if !locked || !matches!(refused, TurntableError::Refused { .. }) {
            return Err(refused);
        }
        self.connection.reset()?;
        self.command("$X").map(|_| ())
    }

    /// Resets a controller that is locked since an emergency stop: it takes neither `$X` nor `$H`
    /// before.
    pub(super) fn clear_emergency_stop(&self) -> Result<(), TurntableError> {
        let status = self.status()?;
        require_released(&status)?;
        if status.alarm.is_some_and(Alarm::is_emergency_stop) {
            self.connection.reset()?;
        }
        Ok(())
    }

    /// Opens a checked session if the controller offers one and none is open.
    pub(super) fn ensure_checked_session(&self) -> Result<(), TurntableError> {
        handshake::ensure_checked_session(&self.connection, self.identity.extras)
    }

    pub(super) fn outcome(
        &self,
        block: &str,
        timeout: ReplyTimeout,
    ) -> Result<LineOutcome, TurntableError> {
        self.ensure_checked_session()?;
        self.connection.line(block, timeout)
    }

    /// Sends a line and waits for its `ok`; returns the messages before it.
    pub(super) fn command(&self, block: &str) -> Result<Vec<Message>, TurntableError> {
        match self.outcome(block, ReplyTimeout::AtOnce)? {
            LineOutcome::Done(messages) => Ok(messages),
            LineOutcome::Refused(code) => Err(refused(block, code)),
            LineOutcome::Failed(fault) => Err(self.lost(block, fault)),
        }
    }

    /// The error for a line without answer. The supervisor stops the table then; waits for that.
    pub(super) fn lost(&self, block: &str, fault: super::protocol::LineFault) -> TurntableError {
        match self.end_by_fault() {
            Err(error) => error,
            Ok(Some(TurntableError::Motion(fault @ MotionFault::PortLost(_)))) => fault.into(),
            Ok(_) => TurntableError::Lost {
                block: block.to_owned(),
                fault,
            },
        }
    }
}

impl Drop for Table {
    fn drop(&mut self) {
        self.connection.supervisor().release(self.clock().now_us());
        if self.connection.supervisor().is_stopping() {
            // Nobody is left to receive an error. The lease, if there is one, also stops the table.
            let _ = self.connection.wait_stopped();
        }
    }
}

/// An error while the emergency stop is pressed.
pub(super) fn require_released(status: &TableStatus) -> Result<(), TurntableError> {
    if status.emergency_stop {
        Err(TurntableError::EmergencyStop)
    } else {
        Ok(())
    }
}

pub(super) fn refused(block: &str, code: u8) -> TurntableError {
    TurntableError::Refused {
        block: block.to_owned(),
        code,
    }
}

/// The line for a linear motion to `machine_deg`, degrees from machine zero.
pub(super) fn straight(machine_deg: f64, speed: f64) -> String {
    format!("G21G90G53G1X{machine_deg:.3}F{:.3}", speed * 60.0)
}
