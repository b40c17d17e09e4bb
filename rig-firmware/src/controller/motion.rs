//! Moves, dwells and homing: what lines wait for, and the driver that has to be awake for it.

use super::{Alarm, Controller, Driver, Job, Mode, Planned, Way};
use crate::board::Board;
use crate::error::Error;
use crate::gcode::Target;
use crate::homing::{self, HomingOutcome, HomingPhase, Leg};
use crate::number::{end_towards, scaled};
use crate::settings::Key;
use crate::stepper::{Full, Move};

/// From feeding the driver to the first step, us.
const DRIVER_LEAD: u32 = 3000;
/// `$1` that never releases the driver.
const NEVER: u32 = 255;

impl Controller {
    /// Goes on with what the line under way waits for.
    pub(super) fn advance<B: Board>(&mut self, board: &mut B) {
        if let Some(stop) = self.stopping {
            self.finish_stop(board, stop);
            return;
        }
        match self.job {
            Job::Move(way) => self.advance_move(board, way),
            Job::Dwell { since, left } => self.advance_dwell(board, since, left),
            Job::Home(phase) => self.advance_homing(board, phase),
            Job::None | Job::Refusal => self.end_jog(board),
        }
    }

    /// Tells the stepper once a jog has ended.
    fn end_jog<B: Board>(&mut self, board: &mut B) {
        if self.jogging {
            self.jogging = board.with_stepper(|stepper, _| {
                let going = stepper.is_moving() || stepper.has_plan();
                stepper.set_jogging(going);
                going
            });
        }
    }

    fn advance_move<B: Board>(&mut self, board: &mut B, way: Way) {
        if self.push_way(board, way).is_ok() {
            self.finish(board, Ok(()));
        }
    }

    fn push_way<B: Board>(&mut self, board: &mut B, way: Way) -> Result<(), Full> {
        let steps = self.saturated_steps(way.target);
        self.push(board, self.planned.steps, steps, way.feed, way.jog)?;
        self.planned = Planned {
            steps,
            angle: way.target,
        };
        self.jogging = way.jog;
        Ok(())
    }

    /// Queues the steps from one position to another.
    fn push<B: Board>(
        &mut self,
        board: &mut B,
        from: i32,
        to: i32,
        feed: u32,
        jog: bool,
    ) -> Result<(), Full> {
        let steps = to.abs_diff(from);
        if steps == 0 {
            return Ok(());
        }
        let feed = feed.min(self.settings.amount(Key::MaxFeed));
        let plan = Move {
            steps,
            forward: to > from,
            cruise: self.profile.cruise(feed),
        };
        board.with_stepper(|stepper, _| {
            stepper.push(plan)?;
            stepper.set_jogging(jog);
            Ok(())
        })
    }

    fn advance_dwell<B: Board>(&mut self, board: &mut B, since: Option<u32>, left: u32) {
        let busy = board.with_stepper(|stepper, _| stepper.is_moving() || stepper.has_plan());
        let now = board.micros();
        let waiting = busy || self.hold;
        let left = match since {
            Some(since) if !waiting => left.saturating_sub(now.wrapping_sub(since)),
            _ => left,
        };
        if !waiting && left == 0 {
            self.finish(board, Ok(()));
        } else {
            let since = (!waiting).then_some(now);
            self.job = Job::Dwell { since, left };
        }
    }

    /// `$H`.
    pub(super) fn start_homing<B: Board>(&mut self, board: &mut B) {
        self.mode = Mode::Ready;
        let active = self.index_is_active(board);
        let leg = homing::start(&self.settings, active);
        self.start_leg(board, leg);
    }

    fn index_is_active<B: Board>(&self, board: &mut B) -> bool {
        board.inputs().index != self.settings.flag(Key::InvertIndex)
    }

    fn start_leg<B: Board>(&mut self, board: &mut B, leg: Leg) {
        let position = board.with_stepper(|stepper, _| stepper.position());
        let way = self.saturated_steps(leg.way);
        let target = leg.from.unwrap_or(position).saturating_add(way);
        if let Some(level) = leg.until {
            board.with_stepper(|stepper, _| stepper.search(level));
        }
        // At rest with nothing queued, there is room.
        let _room = self.push(board, position, target, leg.feed, false);
        self.job = Job::Home(leg.phase);
    }

    fn advance_homing<B: Board>(&mut self, board: &mut B, phase: HomingPhase) {
        let under_way = board.with_stepper(|stepper, _| {
            stepper.is_moving() || (stepper.has_plan() && !stepper.has_found())
        });
        if under_way || self.hold {
            return;
        }
        let found = board.with_stepper(|stepper, _| stepper.end_search());
        self.drop_plans(board);
        let active = self.index_is_active(board);
        match homing::next(&self.settings, phase, found, active) {
            HomingOutcome::Go(leg) => self.start_leg(board, leg),
            HomingOutcome::Zero(step, leg) => {
                board.with_stepper(|stepper, _| stepper.move_origin(step));
                self.start_leg(board, leg);
            }
            HomingOutcome::Home => self.finish(board, Ok(())),
            HomingOutcome::StillActive => self.fail_homing(board, Alarm::IndexStaysActive),
            HomingOutcome::NotFound => self.fail_homing(board, Alarm::IndexNotFound),
        }
    }

    fn fail_homing<B: Board>(&mut self, board: &mut B, alarm: Alarm) {
        self.raise(board, alarm);
        self.finish(board, Err(Error::Locked));
    }

    /// Feeds the driver before steps, starts them, and releases it after rest.
    pub(super) fn drive<B: Board>(&mut self, board: &mut B) {
        let (moving, waiting, planned) = board.with_stepper(|stepper, _| {
            (
                stepper.is_moving(),
                stepper.has_steps(),
                stepper.has_plan() || stepper.is_moving(),
            )
        });
        let now = board.micros();
        self.driver = match self.driver {
            Driver::Off if waiting => {
                board.enable_driver(true);
                Driver::Waking(now)
            }
            Driver::Waking(since) if now.wrapping_sub(since) >= DRIVER_LEAD => Driver::On(None),
            // A hold rests fed: it is to go on from where it stands.
            Driver::On(_) if planned => {
                if waiting && !moving {
                    board.start_steps();
                }
                Driver::On(None)
            }
            Driver::On(None) => Driver::On(Some(now)),
            Driver::On(Some(since)) if self.is_rest_over(now.wrapping_sub(since)) => {
                board.enable_driver(false);
                Driver::Off
            }
            unchanged => unchanged,
        };
    }

    fn is_rest_over(&self, rest: u32) -> bool {
        let delay = self.settings.amount(Key::ReleaseDelay);
        delay != NEVER && rest >= delay * 1000
    }

    /// Where a target lies, thousandths of a degree from machine zero.
    ///
    /// # Errors
    /// [`Error::InvalidTarget`] beyond what positions can tell.
    pub(super) fn resolve(&self, target: Target) -> Result<i32, Error> {
        let angle = match target {
            Target::Absolute(x) => Some(x),
            Target::Relative(x) => x.checked_add(self.planned.angle),
        };
        let angle = angle.ok_or(Error::InvalidTarget)?;
        self.steps(angle).ok_or(Error::InvalidTarget)?;
        Ok(angle)
    }

    /// Whether a place is beyond the soft limit.
    pub(super) fn is_beyond(&self, angle: i32) -> bool {
        let travel = self.settings.amount(Key::Travel);
        self.settings.flag(Key::SoftLimits) && angle.unsigned_abs() > travel
    }

    /// Thousandths of a degree to steps, always from zero: so relative moves do not drift.
    fn steps(&self, angle: i32) -> Option<i32> {
        scaled(angle, self.settings.amount(Key::StepsPerDegree), 1_000_000)
    }

    fn saturated_steps(&self, angle: i32) -> i32 {
        self.steps(angle).unwrap_or(end_towards(angle))
    }

    /// Steps to thousandths of a degree.
    pub(super) fn angle(&self, steps: i32) -> i32 {
        let angle = scaled(steps, 1_000_000, self.settings.amount(Key::StepsPerDegree));
        angle.unwrap_or(end_towards(steps))
    }

    /// Plans from where the table stands; after whatever ended a plan early.
    pub(super) fn plan_from_here<B: Board>(&mut self, board: &mut B) {
        let steps = board.with_stepper(|stepper, _| stepper.position());
        let angle = self.angle(steps);
        self.planned = Planned { steps, angle };
    }
}
