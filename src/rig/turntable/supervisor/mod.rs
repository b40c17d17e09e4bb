//! What is known of the table, and what is done without being asked: no I/O, no threads.
//!
//! It reads the wire's events, keeps the last report and whether the position can be trusted,
//! watches a motion under way, and brings the table to a standstill when something goes wrong.
//! It knows nothing of turns.

mod motion;
mod seen;
mod stop;
#[cfg(test)]
mod tests;

use super::Alarm;
use super::error::Fault;
use super::wire::{
    Counts, Event, LineFault, Machine, Outcome, Patience, Poll, ResetCause, SendError, State,
};
pub(crate) use motion::{Course, Motion};
pub(crate) use seen::{Habits, Seen};
pub(crate) use stop::{Stop, StopOutcome};

/// Between two reports while the table is being stopped, microseconds.
const STOPPING_POLL_US: i64 = 50_000;
/// Between two reports while somebody waits for one, microseconds.
const WANTED_POLL_US: i64 = 100_000;
/// Most reports recorded of one turn: an hour of them at 15 a second.
const MOST_RECORDED: usize = 54_000;

/// Everything known of one table, and the wire to it.
#[derive(Debug)]
pub(crate) struct Supervisor {
    wire: Machine,
    habits: Habits,
    answer: Option<(u64, Outcome)>,
    seen: Option<Seen>,
    confirmed: bool,
    work_zero: Option<f64>,
    /// The angle counted as zero, from machine zero; `None` while the position is not known.
    zero_deg: Option<f64>,
    alarm: Option<u8>,
    restarts: u64,
    motion: Option<Motion>,
    fault: Option<Fault>,
    stop: Option<Stop>,
    /// What the last stop has done to the position is drawn.
    settled: bool,
    recorded: Option<Vec<Seen>>,
    wanted_until_us: i64,
    closed: Option<String>,
    /// Something has happened that somebody may wait for.
    changed: bool,
}

impl Supervisor {
    pub(crate) fn new(habits: Habits) -> Self {
        Self {
            wire: Machine::new(),
            habits,
            answer: None,
            seen: None,
            confirmed: false,
            work_zero: None,
            zero_deg: None,
            alarm: None,
            restarts: 0,
            motion: None,
            fault: None,
            stop: None,
            settled: true,
            recorded: None,
            wanted_until_us: i64::MIN,
            closed: None,
            changed: false,
        }
    }

    pub(crate) fn set_habits(&mut self, habits: Habits) {
        self.habits = habits;
    }

    pub(crate) fn counts(&self) -> Counts {
        self.wire.counts()
    }

    pub(crate) fn is_checked(&self) -> bool {
        self.wire.is_checked()
    }

    pub(crate) fn seen(&self) -> Option<&Seen> {
        self.seen.as_ref()
    }

    /// Whether the last report can be relied on: it came with a checksum, or the one before says
    /// the same. Without, a digit may be wrong.
    pub(crate) fn is_confirmed(&self) -> bool {
        self.is_checked() || self.confirmed
    }

    /// How often the controller has started since the port was opened.
    pub(crate) fn restarts(&self) -> u64 {
        self.restarts
    }

    pub(crate) fn zero_deg(&self) -> Option<f64> {
        self.zero_deg
    }

    pub(crate) fn set_zero_deg(&mut self, machine_deg: f64) {
        self.zero_deg = Some(machine_deg);
    }

    pub(crate) fn alarm(&self) -> Option<Alarm> {
        let locked = self.seen.is_some_and(|seen| seen.state == State::Alarm);
        locked.then_some(Alarm(self.alarm))
    }

    pub(crate) fn fault(&self) -> Option<&Fault> {
        self.fault.as_ref()
    }

    pub(crate) fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref()
    }

    /// Why the port is gone, where it is.
    pub(crate) fn closed(&self) -> Option<&str> {
        self.closed.as_deref()
    }

    /// The port is gone.
    pub(crate) fn close(&mut self, why: String) {
        self.raise(Fault::PortLost(why.clone()));
        self.closed = Some(why);
        self.zero_deg = None;
    }

    /// Whether something has happened since the last call that somebody may wait for.
    pub(crate) fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// Sends a line. Nothing is sent while the table is being stopped.
    pub(crate) fn send(
        &mut self,
        now_us: i64,
        block: &str,
        patience: Patience,
    ) -> Result<u64, SendError> {
        if self.is_stopping() {
            return Err(SendError::Busy);
        }
        self.wire.send(now_us, block, patience)
    }

    /// Opens a checked session.
    pub(crate) fn open_session(&mut self, now_us: i64) -> Result<u64, SendError> {
        if self.is_stopping() {
            return Err(SendError::Busy);
        }
        self.wire.open_session(now_us)
    }

    /// The answer to line `id`, once.
    pub(crate) fn take_answer(&mut self, id: u64) -> Option<Outcome> {
        let (_, outcome) = self.answer.take_if(|(answered, _)| *answered == id)?;
        Some(outcome)
    }

    /// Asks for reports for the next while.
    pub(crate) fn want_reports(&mut self, until_us: i64) {
        self.wanted_until_us = self.wanted_until_us.max(until_us);
    }

    /// Starts watching a motion; faults from before are forgotten.
    pub(crate) fn begin_motion(&mut self, now_us: i64, course: Course) {
        self.fault = None;
        self.motion = Some(Motion::new(now_us, course));
    }

    /// The controller has accepted the line that moves the table.
    pub(crate) fn motion_accepted(&mut self, now_us: i64) {
        if let Some(motion) = &mut self.motion {
            motion.accepted(now_us);
        }
    }

    /// Stops watching.
    pub(crate) fn end_motion(&mut self) {
        self.motion = None;
    }

    /// Keeps reports from now on.
    pub(crate) fn record(&mut self) {
        self.recorded = Some(Vec::new());
    }

    pub(crate) fn recorded(&self) -> &[Seen] {
        self.recorded.as_deref().unwrap_or_default()
    }

    /// Ends keeping reports.
    pub(crate) fn take_recorded(&mut self) -> Vec<Seen> {
        self.recorded.take().unwrap_or_default()
    }

    /// Whether the table is being stopped just now.
    pub(crate) fn is_stopping(&self) -> bool {
        self.stop
            .as_ref()
            .is_some_and(|stop| stop.outcome().is_none())
    }

    /// How the last stop ended; `None` while it is under way or there was none.
    pub(crate) fn stopped(&self) -> Option<StopOutcome> {
        self.stop.as_ref().and_then(Stop::outcome)
    }

    /// Brings the table to a standstill and drops what it was still to do, because somebody asked.
    pub(crate) fn request_stop(&mut self, now_us: i64) {
        if self.motion.is_some() {
            self.raise(Fault::Stopped);
        }
        self.begin_stop(now_us);
    }

    /// Brings the table to a standstill and the controller back to how it starts, so that any
    /// other program can go on with it.
    pub(crate) fn release(&mut self, now_us: i64) {
        if self.is_checked() || self.motion.is_some() || self.moves() {
            self.halt(now_us, true);
        }
    }

    /// Whether the table was moving when it was last heard of.
    pub(crate) fn moves(&self) -> bool {
        self.seen.is_some_and(|seen| seen.state.may_move())
    }

    fn begin_stop(&mut self, now_us: i64) {
        let unsettled = self.wire.is_open();
        self.halt(now_us, unsettled);
    }

    fn halt(&mut self, now_us: i64, unsettled: bool) {
        if !self.is_stopping() {
            self.settled = false;
            self.wire.give_up();
            self.stop = Some(Stop::begin(now_us, unsettled, &mut self.wire));
        }
    }

    /// Notes the first fault of a motion and stops the table.
    fn fail(&mut self, now_us: i64, fault: Fault) {
        self.raise(fault);
        self.begin_stop(now_us);
    }

    fn raise(&mut self, fault: Fault) {
        self.changed = true;
        self.fault.get_or_insert(fault);
    }

    /// What is to be sent now; call it right before writing.
    pub(crate) fn take_output(&mut self, now_us: i64) -> Vec<u8> {
        let every_us = if self.is_stopping() {
            Some(STOPPING_POLL_US)
        } else if self.motion.is_some() {
            Some(i64::try_from(self.habits.poll.as_micros()).unwrap_or(WANTED_POLL_US))
        } else {
            (now_us < self.wanted_until_us).then_some(WANTED_POLL_US)
        };
        self.wire.poll_every(every_us);
        self.wire.take_output(now_us)
    }

    /// Time has passed.
    pub(crate) fn on_time(&mut self, now_us: i64) {
        self.wire.on_time(now_us);
        self.on_events(now_us);
        if let Some(stop) = &mut self.stop {
            stop.on_time(now_us, &mut self.wire);
        }
        self.settle();
        if self.fault.is_none()
            && let Some(fault) = self
                .motion
                .as_ref()
                .and_then(|m| m.overdue(now_us, &self.habits))
        {
            self.fail(now_us, fault);
        }
    }

    /// Bytes have come.
    pub(crate) fn on_bytes(&mut self, now_us: i64, bytes: &[u8]) {
        self.wire.on_bytes(now_us, bytes);
        self.on_events(now_us);
    }

    fn on_events(&mut self, now_us: i64) {
        while let Some(event) = self.wire.next_event() {
            self.changed = true;
            match event {
                Event::Answered { id, outcome } => self.on_answer(now_us, id, outcome),
                Event::Status(poll) => self.on_report(now_us, &poll),
                Event::Reset(cause) => self.on_reset(now_us, cause),
                Event::Alarm(code) => self.on_alarm(now_us, code),
            }
        }
    }

    fn on_answer(&mut self, now_us: i64, id: u64, outcome: Outcome) {
        // A line without answer may have been executed, and its answer may still come: only a
        // table at rest after a reset is certain again.
        if let Outcome::Failed(fault @ (LineFault::NoAnswer { .. } | LineFault::OutOfOrder)) =
            outcome
        {
            self.fail(now_us, Fault::Line(fault));
        }
        self.answer = Some((id, outcome));
    }

    fn on_report(&mut self, now_us: i64, poll: &Poll) {
        self.work_zero = poll.report.work_zero.or(self.work_zero);
        let Some(seen) = Seen::of(poll, self.work_zero, &self.habits) else {
            return;
        };
        self.confirmed = self.seen.is_some_and(|before| before.confirms(&seen));
        self.seen = Some(seen);
        if seen.state != State::Alarm {
            self.alarm = None;
        }
        if let Some(recorded) = &mut self.recorded
            && recorded.len() < MOST_RECORDED
        {
            recorded.push(seen);
        }
        if self.is_stopping() {
            if let Some(stop) = &mut self.stop {
                stop.on_report(now_us, &seen, &mut self.wire);
            }
            self.settle();
        } else if self.fault.is_none()
            && let Some(motion) = &mut self.motion
            && let Some(fault) = motion.on_report(&seen, self.alarm, &self.habits)
        {
            self.fail(now_us, fault);
        }
    }

    /// Forgets the position where a stop has cost it.
    fn settle(&mut self) {
        let Some(outcome) = self.stopped() else {
            return;
        };
        if !self.settled && outcome != StopOutcome::Standing {
            self.zero_deg = None;
        }
        self.changed |= !self.settled;
        self.settled = true;
    }

    fn on_reset(&mut self, now_us: i64, cause: Option<ResetCause>) {
        self.restarts += 1;
        self.alarm = None;
        self.work_zero = None;
        let asked_for = matches!(cause, None | Some(ResetCause::Host));
        let stop = self.stop.as_mut().filter(|stop| stop.outcome().is_none());
        let kept = stop.is_some_and(|stop| stop.on_reset(now_us)) && asked_for;
        if !kept {
            self.zero_deg = None;
        }
        if !self.is_stopping() && self.motion.is_some() {
            self.fail(now_us, Fault::Restarted(cause));
        }
    }

    fn on_alarm(&mut self, now_us: i64, code: u8) {
        let alarm = Alarm(Some(code));
        self.alarm = Some(code);
        if alarm.loses_position() {
            self.zero_deg = None;
        }
        if self.motion.is_some() && !self.is_stopping() {
            self.fail(now_us, Fault::Alarm(alarm));
        }
    }
}
