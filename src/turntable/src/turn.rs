//! A turn in progress.

use std::time::Duration;

use relit_data::turn_motion::{JournaledReport, JournaledTurn};

use super::angle_fit;
use super::angle_fit::AngleFit;
use super::error::TurntableError;
use super::grbl_client::{Table, straight};
use super::plan::TurnPlan;
use super::protocol::{ControllerState, Message, StatusReport};
use super::status::TableStatus;
use super::supervisor::MotionFault;

/// Rest before the start, until the table has stopped swinging.
const SETTLE: Duration = Duration::from_millis(300);
/// Added to the computed time of the ramp.
const RAMP_SLACK: Duration = Duration::from_secs(3);
/// The lease that a turn sets if the controller's is off, seconds.
const LEASE_S: u32 = 3;

impl Table {
    /// Moves back by the ramp and starts the turn. From then on the table moves by itself and is
    /// monitored until the [`Turn`] ends or is dropped.
    ///
    /// If the controller offers a lease (`$60`) and it is off, it is set to 3 s first, so that the
    /// table stops when this computer fails. The controller stores the setting.
    ///
    /// # Errors
    /// [`TurntableError::NotHomed`], [`TurntableError::Failed`], or what stops a motion.
    pub fn start_turn(&self, plan: TurnPlan) -> Result<Turn<'_>, TurntableError> {
        self.ensure_checked_session()?;
        let status = self.ready()?;
        if !status.homed {
            return Err(TurntableError::NotHomed);
        }
        let planned_deg = plan.start_deg;
        if (status.angle_deg - planned_deg).abs() > 2.0 * self.identity().step_deg() {
            return Err(TurntableError::Failed(format!(
                "the turn was planned from {planned_deg:.3} degrees and the table stands at {:.3}: plan it again",
                status.angle_deg
            )));
        }
        if self.identity().lease_s == Some(0.0) {
            self.set_lease()?;
        }
        let zero_deg = self.connection().supervisor().zero_deg();
        Turn::start(self, plan, zero_deg.ok_or(TurntableError::NotHomed)?)
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
}

/// A turn in progress. Dropping it before its end stops the table.
pub struct Turn<'table> {
    table: &'table Table,
    plan: TurnPlan,
    zero_deg: f64,
    over: bool,
}

impl<'table> Turn<'table> {
    fn start(table: &'table Table, plan: TurnPlan, zero_deg: f64) -> Result<Self, TurntableError> {
        let speed = plan.degrees_per_second;
        table.go(zero_deg + plan.back_deg(), speed, zero_deg)?;
        table.clock().sleep(SETTLE);
        table.require_zero(zero_deg)?;
        let end_deg = zero_deg + plan.end_deg();
        let distance = (plan.end_deg() - plan.back_deg()).abs();
        table.connection().supervisor().record();
        table.launch(&straight(end_deg, speed), end_deg, distance, speed)?;
        Ok(Self {
            table,
            plan,
            zero_deg,
            over: false,
        })
    }

    /// Degrees since the speed became constant; negative before.
    fn gone(&self, report: &StatusReport) -> f64 {
        let angle = report.machine_deg - self.zero_deg - self.plan.constant_from_deg();
        angle * self.plan.sign
    }

    /// Waits until the speed is constant; returns since when it is, extrapolated from the first reports there,
    /// microseconds of the host's clock.
    ///
    /// # Errors
    /// The fault that has ended the turn; the table has been stopped.
    pub fn wait_constant(&mut self) -> Result<i64, TurntableError> {
        let speed = self.plan.degrees_per_second;
        let ramp = self.table.travel_time(0.0, speed) + RAMP_SLACK;
        let found = self.table.connection().wait(ramp, |supervisor| {
            if supervisor.fault().is_some() {
                return Some(None);
            }
            let constant = |report: &&StatusReport| {
                report.state == ControllerState::Run && self.gone(report) >= 0.0
            };
            let report = supervisor.recorded().iter().rev().find(constant)?;
            Some(Some((*report, self.gone(report))))
        });
        self.check()?;
        let Some(Some((report, gone))) = found else {
            self.stop()?;
            return Err(MotionFault::Late.into());
        };
        let at_us = report.asked_us.map_or(report.came_us, |asked_us| {
            i64::midpoint(asked_us, report.came_us)
        });
        Ok(at_us - (gone / speed * 1e6).round() as i64)
    }

    /// Waits until the table rests at the turn's end, turns it back, and returns its angles over time.
    ///
    /// # Errors
    /// The fault that has ended the turn; the table has been stopped. [`TurntableError::Failed`] if
    /// the turn is complete but its angles cannot be determined.
    pub fn wait_end(self) -> Result<AngleFit, TurntableError> {
        let (track, finished) = self.wait_rest();
        finished.unwind()?;
        track
    }

    /// Waits until the table rests at the turn's end, and returns its angles over time. They are
    /// known from here on, whatever becomes of the table: also where a fault ended the turn after
    /// its part at constant speed, which [`FinishedTurn::unwind`] reports.
    ///
    /// # Errors
    /// [`TurntableError::Failed`] in the first part of the result, if the angles cannot be determined.
    pub fn wait_rest(mut self) -> (Result<AngleFit, TurntableError>, FinishedTurn<'table>) {
        let plan = &self.plan;
        let distance = (plan.end_deg() - plan.back_deg()).abs();
        let limit = self.table.travel_time(distance, plan.degrees_per_second);
        let arrived = self.table.wait_arrival(limit);
        let reports = self.leave();
        let track = angle_fit::fit(&reports, &self.expected()).map_err(|why| {
            TurntableError::Failed(format!("the turn's angles cannot be determined: {why}"))
        });
        let finished = FinishedTurn {
            table: self.table,
            arrived,
            back_to: self.zero_deg + self.plan.start_deg,
            zero_deg: self.zero_deg,
        };
        (track, finished)
    }

    /// The reports of the part at constant speed that came after the first `seen` of the turn, and
    /// how many of the turn there are now.
    pub fn reports_after(&self, seen: usize) -> (Vec<JournaledReport>, usize) {
        let expected = self.expected();
        let supervisor = self.table.connection().supervisor();
        let recorded = supervisor.recorded();
        let new = recorded.get(seen..).unwrap_or_default().iter();
        let timed = new.filter_map(|report| angle_fit::timed(report, &expected));
        (timed.collect(), recorded.len())
    }

    /// The turn in machine positions.
    pub fn expected(&self) -> JournaledTurn {
        JournaledTurn {
            from_deg: self.zero_deg + self.plan.constant_from_deg(),
            to_deg: self.zero_deg + self.plan.constant_to_deg(),
            degrees_per_second: self.plan.degrees_per_second,
            zero_deg: self.zero_deg,
            step_deg: self.table.identity().step_deg(),
        }
    }

    /// Stops the table in the middle of the turn.
    ///
    /// # Errors
    /// [`TurntableError::NotStopped`].
    pub fn abort(mut self) -> Result<TableStatus, TurntableError> {
        self.stop()
    }

    fn stop(&mut self) -> Result<TableStatus, TurntableError> {
        let stopped = self.table.stop();
        self.leave();
        stopped
    }

    /// Ends the turn if a fault has occurred.
    ///
    /// # Errors
    /// That fault; the table has been stopped.
    pub fn check(&mut self) -> Result<(), TurntableError> {
        match self.table.end_by_fault() {
            Ok(None) => Ok(()),
            Ok(Some(error)) | Err(error) => {
                self.leave();
                Err(error)
            }
        }
    }

    /// Ends the monitoring; returns the reports.
    fn leave(&mut self) -> Vec<StatusReport> {
        self.over = true;
        let mut supervisor = self.table.connection().supervisor();
        supervisor.end_motion();
        supervisor.take_recorded()
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        if !self.over {
            // A drop cannot return an error. Dropping the table stops it again.
            let _ = self.stop();
        }
    }
}

/// A turn that is over, whose table has not turned back yet.
#[must_use = "the cable stays wound until the table turns back"]
pub struct FinishedTurn<'table> {
    table: &'table Table,
    arrived: Result<(), TurntableError>,
    /// Where the turn began, degrees from machine zero.
    back_to: f64,
    zero_deg: f64,
}

impl FinishedTurn<'_> {
    /// Turns the table back to where the turn began.
    ///
    /// # Errors
    /// The fault that has ended the turn or the way back; the table has been stopped.
    pub fn unwind(self) -> Result<(), TurntableError> {
        self.arrived?;
        let speed = self.table.default_speed();
        self.table.go(self.back_to, speed, self.zero_deg)
    }
}
