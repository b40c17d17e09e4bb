//! Real-time bytes, emergency stop, resets and alarms.

use super::{Alarm, Controller, Driver, Job, Mode, Stop};
use crate::board::{Board, Events};
use crate::checked::Session;
use crate::error::Error;
use crate::gcode::Modal;
use crate::report::Reply;
use crate::settings::Key;

/// More bytes than a receive buffer holds.
const DRAIN: u16 = 512;

impl Controller {
    /// Follows what interrupts noted.
    pub(super) fn follow_events<B: Board>(&mut self, board: &mut B) {
        let events = self.pending.take();
        let pressed = board.inputs().emergency_stop != self.settings.flag(Key::InvertEmergency);
        if pressed || events.contains(Events::EMERGENCY) {
            self.stop_emergency(board);
        }
        if events.contains(Events::RECEIVED) {
            self.heard = board.micros();
        }
        if events.contains(Events::RESET) {
            self.reset(board, pressed);
        } else {
            if events.contains(Events::LOST_INPUT) {
                self.reader.lose();
            }
            self.follow_stops(board, events);
        }
        if events.contains(Events::STATUS) {
            self.report_status(board);
        }
    }

    /// `!`, `~` and jog cancel. The interrupt has begun the ramp already.
    fn follow_stops<B: Board>(&mut self, board: &mut B, events: Events) {
        let hold = events.contains(Events::HOLD);
        let cancel = events.contains(Events::JOG_CANCEL);
        if self.stopping.is_some() || !(hold || cancel || events.contains(Events::RESUME)) {
            return;
        }
        if self.jogging && (hold || cancel) {
            self.stop(board, Stop::Jog);
        } else if hold && self.mode == Mode::Ready {
            self.hold = true;
            board.with_stepper(|stepper, _| stepper.hold());
        } else if hold || !self.hold {
            // Nothing that could be held, or a cancel that came as the jog ended.
            self.release_hold(board);
        } else if events.contains(Events::RESUME) {
            self.hold = false;
            self.release_hold(board);
        }
    }

    /// Lets the steps go on, unless they are held because homing has found the index.
    fn release_hold<B: Board>(&mut self, board: &mut B) {
        board.with_stepper(|stepper, _| {
            if !stepper.has_found() {
                stepper.resume();
            }
        });
    }

    /// Ramps to a stop, and does then what `stop` says.
    pub(super) fn stop<B: Board>(&mut self, board: &mut B, stop: Stop) {
        board.with_stepper(|stepper, _| stepper.hold());
        self.stopping = Some(stop);
    }

    /// Once the table stands: drops the plan.
    pub(super) fn finish_stop<B: Board>(&mut self, board: &mut B, stop: Stop) {
        if board.with_stepper(|stepper, _| stepper.is_moving()) {
            return;
        }
        self.drop_plans(board);
        match stop {
            Stop::Jog => self.finish(board, Ok(())),
            Stop::Alarm(alarm) => {
                self.raise(board, alarm);
                self.finish(board, Err(Error::Locked));
            }
        }
    }

    /// Forgets all moves; at rest.
    pub(super) fn drop_plans<B: Board>(&mut self, board: &mut B) {
        board.with_stepper(|stepper, _| {
            stepper.end_search();
            stepper.drop_plan();
        });
        self.hold = false;
        self.jogging = false;
        self.stopping = None;
        self.plan_from_here(board);
    }

    /// Locks the table and says why.
    pub(super) fn raise<B: Board>(&mut self, board: &mut B, alarm: Alarm) {
        self.mode = Mode::Alarm(alarm);
        let mut reply = Reply::new(board, self.session.is_open());
        reply.text("ALARM:").whole(alarm as u32).end();
    }

    /// The emergency stop is or was active.
    fn stop_emergency<B: Board>(&mut self, board: &mut B) {
        board.with_stepper(|stepper, _| {
            stepper.halt();
            stepper.clear_halt();
        });
        board.enable_driver(false);
        self.driver = Driver::Off;
        if self.emergency {
            return;
        }
        self.emergency = true;
        self.drop_plans(board);
        self.raise(board, Alarm::Emergency);
        self.finish(board, Err(Error::Locked));
    }

    /// 0x18: starts again. The interrupt has stopped the steps already.
    fn reset<B: Board>(&mut self, board: &mut B, pressed: bool) {
        let in_motion = board.with_stepper(|stepper, _| {
            stepper.halt();
            stepper.clear_halt()
        });
        let homing = matches!(self.job, Job::Home(_));
        self.drop_plans(board);
        if homing {
            self.raise(board, Alarm::ResetInHoming);
        } else if in_motion {
            self.raise(board, Alarm::ResetInMotion);
        }
        for _ in 0..DRAIN {
            if board.receive().is_none() {
                break;
            }
        }
        self.emergency &= pressed;
        self.restart(board);
    }

    /// The state after a reset, and the banner. Position and locks stay.
    pub(super) fn restart<B: Board>(&mut self, board: &mut B) {
        self.mode = match self.mode {
            Mode::Alarm(alarm) if !alarm.keeps_position() => self.mode,
            _ => Mode::Ready,
        };
        self.job = Job::None;
        self.sequence = None;
        self.session = Session::Closed;
        self.reader.reset();
        self.modal = Modal::new();
        self.banner(board, "host");
    }

    pub(super) fn banner<B: Board>(&mut self, board: &mut B, cause: &str) {
        Reply::new(board, false).end();
        let mut reply = Reply::new(board, false);
        reply.text("Grbl 1.1h ['$' for help] [reset: ");
        reply.text(cause).text("]").end();
        if matches!(self.mode, Mode::Alarm(_)) {
            let mut reply = Reply::new(board, false);
            reply.text("[MSG:'$H'|'$X' to unlock]").end();
        }
    }
}
