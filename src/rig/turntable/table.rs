//! The table: what a program does with it.

use std::path::Path;
use std::time::Duration;

use super::error::TurntableError;
use super::greeting;
use super::identity::Identity;
use super::link::{IoThread, Link};
use super::owner::{Claim, Server};
use super::plan::TurnPlan;
use super::port::{Port, SerialPort};
use super::status::Status;
use super::supervisor::Course;
use super::turn::Turn;
use super::wire::{Counts, Message, Outcome, Patience, State};
use super::{LEASE_S, Options};
use crate::clock::{Clock, Waitable};

/// What is added to the time a motion should take.
const MOTION_SLACK: Duration = Duration::from_secs(4);
/// Fastest jog and unwinding that is not asked for otherwise, degrees a second.
const BRISK: f64 = 30.0;

/// A table, owned by this process. It is stopped when this is dropped.
pub struct Table {
    // Fields are dropped in this order: nobody asks any more, the port is closed, and then
    // another process may have it.
    server: Option<Server>,
    link: Link,
    _io_thread: IoThread,
    _claim: Option<Claim>,
    identity: Identity,
    /// Whether a line waits for its answer.
    line_open: Waitable<bool>,
}

impl Table {
    /// Takes over the controller behind `port`: waits until it has started, stops it if it moves,
    /// and reads what it is.
    ///
    /// # Errors
    /// [`TurntableError::NoController`], or what else went wrong on the way.
    pub fn open(port: impl Port, options: &Options) -> Result<Table, TurntableError> {
        Self::greet(Box::new(port), None, options)
    }

    /// Opens a serial port for this process alone, and lets other processes ask it for `status`
    /// and `stop` through [`super::Owner`].
    ///
    /// # Errors
    /// [`TurntableError::Owned`] where another process has it, and what [`Table::open`] says.
    pub fn open_serial(path: &Path, options: &Options) -> Result<Table, TurntableError> {
        // Opening the port resets an Arduino: nobody may own it by then.
        let claim = Claim::take(path, &options.runtime_folder)?;
        let port = SerialPort::open(path)?;
        Self::greet(Box::new(port), Some(claim), options)
    }

    fn greet(
        port: Box<dyn Port>,
        claim: Option<Claim>,
        options: &Options,
    ) -> Result<Table, TurntableError> {
        let resets = port.resets();
        let (link, io_thread) = Link::start(port, &options.clock, greeting::STRANGER)?;
        let identity = greeting::greet(&link, resets, options)?;
        let server = claim.as_ref().map(|claim| claim.serve(link.clone()));
        Ok(Table {
            server: server.transpose()?,
            link,
            _io_thread: io_thread,
            _claim: claim,
            identity,
            line_open: Waitable::new(&options.clock, false),
        })
    }

    /// What the controller is.
    #[must_use]
    pub fn identity(&self) -> &Identity {
        &self.identity
    }

    /// What went wrong on the wire so far and was put right or noticed.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.link.supervisor().counts()
    }

    pub(super) fn clock(&self) -> &Clock {
        self.link.clock()
    }

    pub(super) fn link(&self) -> &Link {
        &self.link
    }

    /// What the table is doing just now.
    ///
    /// # Errors
    /// [`TurntableError::Silent`].
    pub fn status(&self) -> Result<Status, TurntableError> {
        self.link.status()
    }

    /// Turns by `degrees` and waits until the table is there. Speed in degrees a second; brisk
    /// where it is not given.
    ///
    /// # Errors
    /// [`TurntableError::BeyondLimit`], [`TurntableError::NotReady`], or what ended the motion.
    pub fn jog(&self, degrees: f64, speed: Option<f64>) -> Result<Status, TurntableError> {
        let speed = speed.unwrap_or_else(|| self.brisk());
        self.identity.check_speed(speed)?;
        if !degrees.is_finite() {
            return Err(TurntableError::Figure {
                what: "the angle in degrees",
                value: degrees,
                range: "it has to be a number".to_owned(),
            });
        }
        let status = self.ready()?;
        let (low_deg, high_deg) = self.identity.limits_from(&status);
        let target_deg = status.angle_deg + degrees;
        if !(low_deg..=high_deg).contains(&target_deg) {
            return Err(TurntableError::BeyondLimit {
                target_deg,
                low_deg,
                high_deg,
            });
        }
        let machine_deg = status.machine_deg + degrees;
        // To a place instead of by an angle: sent twice it would still move once.
        let block = format!("$J=G21G90G53X{machine_deg:.3}F{:.3}", speed * 60.0);
        self.travel(&block, &status, machine_deg, speed)?;
        self.status()
    }

    pub(super) fn brisk(&self) -> f64 {
        self.identity.max_degrees_per_second.min(BRISK)
    }

    /// Moves straight to a place, degrees from machine zero, and waits until the table is there.
    pub(super) fn go(&self, machine_deg: f64, speed: f64) -> Result<(), TurntableError> {
        let status = self.ready()?;
        let block = straight(machine_deg, speed);
        self.travel(&block, &status, machine_deg, speed)
    }

    fn travel(
        &self,
        block: &str,
        from: &Status,
        machine_deg: f64,
        speed: f64,
    ) -> Result<(), TurntableError> {
        let distance = (machine_deg - from.machine_deg).abs();
        self.launch(block, machine_deg, distance, speed)?;
        let arrived = self.wait_arrival(self.travel_time(distance, speed));
        self.link.supervisor().end_motion();
        arrived
    }

    /// Longest time that a motion may take.
    pub(super) fn travel_time(&self, distance_deg: f64, speed: f64) -> Duration {
        let ramps = speed / self.identity.acceleration;
        Duration::try_from_secs_f64((distance_deg / speed + ramps) * 1.05)
            .unwrap_or(Duration::MAX / 4)
            .saturating_add(MOTION_SLACK)
    }

    /// Sends the line that moves the table, and watches it from then on.
    pub(super) fn launch(
        &self,
        block: &str,
        target_deg: f64,
        distance: f64,
        speed: f64,
    ) -> Result<(), TurntableError> {
        let time = self.travel_time(distance, speed);
        self.begin(Course::To {
            target_deg,
            within_us: i64::try_from(time.as_micros()).unwrap_or(i64::MAX),
        })?;
        let sent = self.command(block);
        let mut supervisor = self.link.supervisor();
        match sent {
            Ok(_) => supervisor.motion_accepted(self.clock().now_us()),
            Err(_) => supervisor.end_motion(),
        }
        sent.map(|_| ())
    }

    /// Waits until the table is at its target, or has been stopped by a fault.
    pub(super) fn wait_arrival(&self, limit: Duration) -> Result<(), TurntableError> {
        let ended = self.link.wait(limit + MOTION_SLACK, |supervisor| {
            let arrived = supervisor
                .motion()
                .is_some_and(|motion| motion.is_at_target());
            (arrived || supervisor.fault().is_some()).then_some(())
        });
        match self.end_by_fault()? {
            Some(fault) => Err(fault),
            None if ended.is_none() => {
                self.stop()?;
                Err(super::error::Fault::Late.into())
            }
            None => Ok(()),
        }
    }

    /// The fault that has ended a motion, once the table has been stopped because of it.
    pub(super) fn end_by_fault(&self) -> Result<Option<TurntableError>, TurntableError> {
        let fault = self.link.supervisor().fault().cloned();
        if let Some(fault) = fault {
            let gone = self.link.supervisor().closed().is_some();
            if !gone {
                self.link.wait_stopped()?;
            }
            return Ok(Some(fault.into()));
        }
        Ok(None)
    }

    /// Starts watching a motion, unless one is under way.
    pub(super) fn begin(&self, course: Course) -> Result<(), TurntableError> {
        self.secure()?;
        let mut supervisor = self.link.supervisor();
        if supervisor.is_stopping() || supervisor.motion().is_some() {
            return Err(TurntableError::Busy);
        }
        supervisor.begin_motion(self.clock().now_us(), course);
        Ok(())
    }

    /// The status of a table that can take a motion.
    pub(super) fn ready(&self) -> Result<Status, TurntableError> {
        let status = self.status()?;
        let supervisor = self.link.supervisor();
        if supervisor.is_stopping() || supervisor.motion().is_some() {
            return Err(TurntableError::Busy);
        }
        match status.state {
            State::Idle => Ok(status),
            state => Err(TurntableError::NotReady {
                state,
                alarm: status.alarm,
            }),
        }
    }

    /// Ramps the table down, drops what it was still to do, and makes sure that it stands.
    ///
    /// # Errors
    /// [`TurntableError::NotStopped`] where it was not seen at rest.
    pub fn stop(&self) -> Result<Status, TurntableError> {
        self.link.stop()
    }

    /// Unlocks the table after an alarm.
    ///
    /// # Errors
    /// [`TurntableError::Refused`] while the emergency stop is pressed.
    pub fn unlock(&self) -> Result<Status, TurntableError> {
        self.command("$X")?;
        self.status()
    }

    /// Moves back by the ramp, and starts the turn; it goes on by itself from then on, and is
    /// watched until [`Turn`] ends or is dropped.
    ///
    /// Where the controller offers a lease (`$60`) and it is off, it is set to 3 s first, so that
    /// the table stops when this computer fails; that is stored in the controller and so done
    /// once in its life.
    ///
    /// # Errors
    /// [`TurntableError::NotHomed`], [`TurntableError::Moved`], or what stops a motion.
    pub fn start_turn(&self, plan: TurnPlan) -> Result<Turn<'_>, TurntableError> {
        self.secure()?;
        let status = self.ready()?;
        if !status.homed {
            return Err(TurntableError::NotHomed);
        }
        let planned_deg = plan.start_deg();
        if (status.angle_deg - planned_deg).abs() > 2.0 * self.identity.step_deg() {
            return Err(TurntableError::Moved {
                planned_deg,
                at_deg: status.angle_deg,
            });
        }
        if self.identity.lease_s == Some(0.0) {
            self.set_lease()?;
        }
        Turn::start(self, plan, status.machine_deg - status.angle_deg)
    }

    fn set_lease(&self) -> Result<(), TurntableError> {
        let set = |messages: &[Message]| {
            let lease = |message: &Message| matches!(message, Message::Setting { number: 60, value } if *value > 0.0);
            messages.iter().any(lease)
        };
        if !set(&self.command("$$")?) {
            self.command(&format!("$60={LEASE_S}"))?;
        }
        Ok(())
    }

    /// Opens a checked session where the controller offers one and none is open.
    fn secure(&self) -> Result<(), TurntableError> {
        let _turn = LineTurn::take(&self.line_open);
        greeting::secure(&self.link, &self.identity.extras)
    }

    pub(super) fn outcome(
        &self,
        block: &str,
        patience: Patience,
    ) -> Result<Outcome, TurntableError> {
        self.secure()?;
        let _turn = LineTurn::take(&self.line_open);
        self.link.line(block, patience)
    }

    /// Sends a line and waits for its `ok`; gives what stood in front of it.
    fn command(&self, block: &str) -> Result<Vec<Message>, TurntableError> {
        match self.outcome(block, Patience::Short)? {
            Outcome::Done(messages) => Ok(messages),
            Outcome::Refused(code) => Err(refused(block, code)),
            Outcome::Failed(fault) => Err(self.lost(block, fault)),
        }
    }

    /// A line without answer: the table is being stopped for it, and that is waited for.
    pub(super) fn lost(&self, block: &str, fault: super::wire::LineFault) -> TurntableError {
        match self.end_by_fault() {
            Err(error) => error,
            Ok(Some(TurntableError::Motion(fault @ super::error::Fault::PortLost(_)))) => {
                fault.into()
            }
            Ok(_) => TurntableError::Lost {
                block: block.to_owned(),
                fault,
            },
        }
    }
}

/// The right to send a line and to wait for its answer, which one thread has at a time.
struct LineTurn<'a>(&'a Waitable<bool>);

impl<'a> LineTurn<'a> {
    fn take(open: &'a Waitable<bool>) -> Self {
        open.wait(|open| (!std::mem::replace(open, true)).then_some(()));
        Self(open)
    }
}

impl Drop for LineTurn<'_> {
    fn drop(&mut self) {
        self.0.update(|open| *open = false);
    }
}

impl Drop for Table {
    fn drop(&mut self) {
        self.server = None;
        self.link.supervisor().release(self.clock().now_us());
        if self.link.supervisor().is_stopping() {
            // There is nobody left to tell; the lease, where there is one, stops the table too.
            let _ = self.link.wait_stopped();
        }
    }
}

pub(super) fn refused(block: &str, code: u8) -> TurntableError {
    TurntableError::Refused {
        block: block.to_owned(),
        code,
    }
}

/// The line that moves straight to a place, degrees from machine zero.
pub(super) fn straight(machine_deg: f64, speed: f64) -> String {
    format!("G21G90G53G1X{machine_deg:.3}F{:.3}", speed * 60.0)
}
