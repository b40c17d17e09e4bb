//! The state machine above the protocol, without I/O and without threads.
//!
//! It processes the protocol's events, keeps the last report and whether the position is still known,
//! monitors a motion in progress, and brings the table to a standstill when something goes wrong.
//! It knows nothing of turns.

mod controller_features;
mod fault;
mod motion;
mod stop;
#[cfg(test)]
mod tests;

use super::codes::Alarm;
use super::protocol::{
    ControllerState, Counts, LineFault, LineOutcome, Machine, ProtocolEvent, ReplyTimeout,
    SendError, StatusReport,
};
pub(crate) use controller_features::ControllerFeatures;
pub use fault::MotionFault;
pub(crate) use motion::{Motion, MotionGoal};

pub(crate) use stop::{Stop, StopOutcome};

/// Interval of reports while the table is being stopped, microseconds.
const STOPPING_POLL_US: i64 = 50_000;
/// Interval of reports while somebody waits for one, microseconds.
const WANTED_POLL_US: i64 = 100_000;
/// What the rig's firmware calls a restart that the host asked for.
const HOST_RESET: &str = "host";
/// Limit of recorded reports: an hour at 15 per second.
const MAX_RECORDED: usize = 54_000;

/// The state of one table, and the protocol to it.
#[derive(Debug, Default)]
pub(crate) struct Supervisor {
    machine: Machine,
    traits: ControllerFeatures,
    answer: Option<(u64, LineOutcome)>,
    last_report: Option<StatusReport>,
    confirmed: bool,
    /// Machine position of the angle 0, degrees; `None` if it is unknown.
    zero_deg: Option<f64>,
    /// The angle 0 was known until the controller restarted.
    restarted: bool,
    /// Where the table rests, degrees from machine zero, if it was seen there and has not been sent
    /// elsewhere since.
    rest_deg: Option<f64>,
    /// Whether the controller counts itself as homed, by the last report that says so.
    homed: Option<bool>,
    alarm: Option<u8>,
    /// The emergency stop was seen pressed since the table was locked.
    emergency_stop: bool,
    restarts: u64,
    motion: Option<Motion>,
    fault: Option<MotionFault>,
    stop: Option<Stop>,
    /// The last stop's effect on the position has to be applied.
    is_unapplied: bool,
    recorded: Option<Vec<StatusReport>>,
    wanted_until_us: i64,
    closed: Option<String>,
    /// Something has changed that a thread may be waiting for.
    changed: bool,
}

impl Supervisor {
    pub(crate) fn new(traits: ControllerFeatures) -> Self {
        Self {
            traits,
            ..Self::default()
        }
    }

    pub(crate) fn set_features(&mut self, traits: ControllerFeatures) {
        self.traits = traits;
    }

    pub(crate) fn counts(&self) -> Counts {
        self.machine.counts()
    }

    pub(crate) fn is_checked(&self) -> bool {
        self.machine.is_checked()
    }

    pub(crate) fn last_report(&self) -> Option<&StatusReport> {
        self.last_report.as_ref()
    }

    /// Whether the last report is reliable: it had a checksum, or the report before agrees with it.
    /// Otherwise a digit may be wrong.
    pub(crate) fn is_confirmed(&self) -> bool {
        self.is_checked() || self.confirmed
    }

    /// Number of restarts of the controller since the port was opened.
    pub(crate) fn restarts(&self) -> u64 {
        self.restarts
    }

    pub(crate) fn zero_deg(&self) -> Option<f64> {
        self.zero_deg
    }

    pub(crate) fn set_zero_deg(&mut self, machine_deg: f64) {
        self.zero_deg = Some(machine_deg);
        self.restarted = false;
    }

    /// Whether the angle 0 was known until the controller restarted.
    pub(crate) fn has_restarted(&self) -> bool {
        self.restarted
    }

    pub(crate) fn alarm(&self) -> Option<Alarm> {
        let locked = self
            .last_report
            .is_some_and(|report| report.state == ControllerState::Alarm);
        locked.then(|| self.alarm_of(self.alarm))
    }

    fn alarm_of(&self, code: Option<u8>) -> Alarm {
        Alarm {
            code,
            family: self.traits.family,
            emergency_stop: self.emergency_stop,
        }
    }

    pub(crate) fn fault(&self) -> Option<&MotionFault> {
        self.fault.as_ref()
    }

    pub(crate) fn motion(&self) -> Option<&Motion> {
        self.motion.as_ref()
    }

    /// Why the port is gone, if it is.
    pub(crate) fn closed(&self) -> Option<&str> {
        self.closed.as_deref()
    }

    /// Notes that the port is gone.
    pub(crate) fn close(&mut self, why: String) {
        self.raise(MotionFault::PortLost(why.clone()));
        self.closed = Some(why);
        self.zero_deg = None;
    }

    /// Whether something has changed since the last call that a thread may be waiting for.
    pub(crate) fn take_changed(&mut self) -> bool {
        std::mem::take(&mut self.changed)
    }

    /// Sends a line, unless the table is being stopped.
    pub(crate) fn send(
        &mut self,
        now_us: i64,
        block: &str,
        timeout: ReplyTimeout,
    ) -> Result<u64, SendError> {
        if self.is_stopping() {
            return Err(SendError::Busy);
        }
        self.machine.send(now_us, block, timeout)
    }

    /// Opens a checked session.
    pub(crate) fn open_session(&mut self, now_us: i64) -> Result<u64, SendError> {
        if self.is_stopping() {
            return Err(SendError::Busy);
        }
        self.machine.open_session(now_us)
    }

    /// Takes the answer to line `id`.
    pub(crate) fn take_answer(&mut self, id: u64) -> Option<LineOutcome> {
        let (_, outcome) = self.answer.take_if(|(answered, _)| *answered == id)?;
        Some(outcome)
    }

    /// Requests reports until this time.
    pub(crate) fn want_reports(&mut self, until_us: i64) {
        self.wanted_until_us = self.wanted_until_us.max(until_us);
    }

    /// Starts to monitor a motion; clears the last fault.
    pub(crate) fn begin_motion(&mut self, now_us: i64, goal: MotionGoal) {
        self.fault = None;
        self.rest_deg = None;
        self.motion = Some(Motion::new(now_us, goal));
    }

    /// Notes that the controller has accepted the line that moves the table.
    pub(crate) fn motion_accepted(&mut self, now_us: i64) {
        if let Some(motion) = &mut self.motion {
            motion.accepted(now_us);
        }
    }

    /// Ends the monitoring.
    pub(crate) fn end_motion(&mut self) {
        let arrived = self.motion.take().is_some_and(|m| m.is_at_target());
        let last = self.last_report.filter(|_| arrived);
        self.rest_deg = last.map(|report| report.machine_deg);
    }

    /// Records reports from now on.
    pub(crate) fn record(&mut self) {
        self.recorded = Some(Vec::new());
    }

    pub(crate) fn recorded(&self) -> &[StatusReport] {
        self.recorded.as_deref().unwrap_or_default()
    }

    /// Ends the recording; returns the reports.
    pub(crate) fn take_recorded(&mut self) -> Vec<StatusReport> {
        self.recorded.take().unwrap_or_default()
    }

    /// Whether a stop is in progress.
    pub(crate) fn is_stopping(&self) -> bool {
        self.stop
            .as_ref()
            .is_some_and(|stop| stop.outcome().is_none())
    }

    /// How the last stop ended; `None` if it is in progress or there was none.
    pub(crate) fn stopped(&self) -> Option<StopOutcome> {
        self.stop.as_ref().and_then(Stop::outcome)
    }

    /// Brings the table to a standstill and discards its remaining motions, on request.
    pub(crate) fn request_stop(&mut self, now_us: i64) {
        if self.motion.is_some() {
            self.raise(MotionFault::Stopped);
        }
        self.begin_stop(now_us);
    }

    /// The same, and resets the controller as soon as the table stands.
    pub(crate) fn request_reset(&mut self, now_us: i64) {
        if self.motion.is_some() {
            self.raise(MotionFault::Stopped);
        }
        self.halt(now_us, true);
    }

    /// Brings the table to a standstill and the controller to its initial state, so that any other
    /// program can use it.
    pub(crate) fn release(&mut self, now_us: i64) {
        if self.is_checked() || self.motion.is_some() || self.moves() {
            self.halt(now_us, true);
        }
    }

    /// Whether the table moves according to the last report.
    pub(crate) fn moves(&self) -> bool {
        self.last_report
            .is_some_and(|report| report.state.may_move())
    }

    fn begin_stop(&mut self, now_us: i64) {
        let unsettled = self.machine.is_open();
        self.halt(now_us, unsettled);
    }

    fn halt(&mut self, now_us: i64, unsettled: bool) {
        if !self.is_stopping() {
            self.is_unapplied = true;
            self.machine.give_up();
            self.stop = Some(Stop::begin(now_us, unsettled, &mut self.machine));
        }
    }

    /// Stops the table because of a fault. One that stands elsewhere than it was sent may count wrong.
    fn fail(&mut self, now_us: i64, fault: MotionFault) {
        match fault {
            MotionFault::Restarted(_) => self.lose_by_restart(),
            MotionFault::Astray { .. } => self.zero_deg = None,
            _ => {}
        }
        self.raise(fault);
        self.begin_stop(now_us);
    }

    /// Notes a fault. The first one of a motion is kept.
    fn raise(&mut self, fault: MotionFault) {
        self.changed = true;
        self.fault.get_or_insert(fault);
    }

    /// The bytes to be sent now. Call it right before writing.
    pub(crate) fn take_output(&mut self, now_us: i64) -> Vec<u8> {
        let every_us = if self.is_stopping() {
            Some(STOPPING_POLL_US)
        } else if self.motion.is_some() {
            Some(i64::try_from(self.traits.poll.as_micros()).unwrap_or(WANTED_POLL_US))
        } else {
            (now_us < self.wanted_until_us).then_some(WANTED_POLL_US)
        };
        self.machine.poll_every(every_us);
        self.machine.take_output(now_us)
    }

    /// Processes the passing of time.
    pub(crate) fn on_time(&mut self, now_us: i64) {
        self.machine.on_time(now_us);
        self.on_events(now_us);
        if let Some(stop) = &mut self.stop {
            stop.on_time(now_us, &mut self.machine);
        }
        self.settle();
        if self.fault.is_none()
            && let Some(fault) = self
                .motion
                .as_ref()
                .and_then(|m| m.overdue(now_us, &self.traits))
        {
            self.fail(now_us, fault);
        }
    }

    /// Processes received bytes.
    pub(crate) fn on_bytes(&mut self, now_us: i64, bytes: &[u8]) {
        self.machine.on_bytes(now_us, bytes);
        self.on_events(now_us);
    }

    fn on_events(&mut self, now_us: i64) {
        while let Some(event) = self.machine.next_event() {
            self.changed = true;
            match event {
                ProtocolEvent::Answered { id, outcome } => self.on_answer(now_us, id, outcome),
                ProtocolEvent::Status(report) => self.on_report(now_us, report),
                ProtocolEvent::Reset(cause) => self.on_reset(now_us, cause),
                ProtocolEvent::Alarm(code) => self.on_alarm(now_us, code),
            }
        }
    }

    fn on_answer(&mut self, now_us: i64, id: u64, outcome: LineOutcome) {
        // A line without answer may have been executed, and its answer may still arrive: only a
        // reset of a table at rest makes the state certain again.
        if let LineOutcome::Failed(fault @ (LineFault::NoAnswer { .. } | LineFault::OutOfOrder)) =
            outcome
        {
            self.fail(now_us, MotionFault::Line(fault));
        }
        self.answer = Some((id, outcome));
    }

    fn on_report(&mut self, now_us: i64, mut report: StatusReport) {
        report.chip_us = report.chip_us.filter(|_| self.traits.stamps);
        self.confirmed = self
            .last_report
            .is_some_and(|before| before.confirms(&report));
        self.last_report = Some(report);
        self.note_alarm(&report);
        if let Some(recorded) = &mut self.recorded
            && recorded.len() < MAX_RECORDED
        {
            recorded.push(report);
        }
        let displaced = self.is_displaced(&report);
        if displaced {
            self.restarts += 1;
            self.lose_by_restart();
        }
        if self.is_stopping() {
            if let Some(stop) = &mut self.stop {
                stop.on_report(now_us, &report, &mut self.machine);
            }
            self.settle();
            return;
        }
        let alarm = self.alarm();
        let Some(motion) = self.motion.as_mut().filter(|_| self.fault.is_none()) else {
            return;
        };
        let fault = if displaced {
            Some(MotionFault::Restarted(None))
        } else {
            motion.on_report(&report, alarm, &self.traits)
        };
        if let Some(fault) = fault {
            self.fail(now_us, fault);
        }
    }

    /// Notes what a report says about an alarm.
    fn note_alarm(&mut self, report: &StatusReport) {
        if report.state != ControllerState::Alarm {
            self.alarm = None;
            self.emergency_stop = false;
            return;
        }
        self.alarm = report.alarm.or(self.alarm);
        if report.pins.emergency_stop {
            // The controller says so once; a reset in the meantime does not make it say so again.
            self.emergency_stop = true;
            self.alarm = self.alarm.or(self.traits.family.emergency_stop_alarm());
        }
        if self.alarm_of(self.alarm).loses_position() {
            self.zero_deg = None;
        }
    }

    /// Whether a report shows that the controller counts from another place than before although the
    /// table was not sent there: it has restarted, and its banner was lost or is none that is known.
    fn is_displaced(&mut self, report: &StatusReport) -> bool {
        let tolerance_deg = self.traits.tolerance_deg();
        let was_homed = self.homed;
        self.homed = report.homed.or(was_homed);
        if let Some(motion) = &mut self.motion {
            return motion.went_back(report, tolerance_deg);
        }
        if report.state.may_move() {
            self.rest_deg = None;
            return false;
        }
        if !self.is_confirmed() {
            return false;
        }
        let before = self.rest_deg.replace(report.machine_deg);
        let elsewhere =
            before.is_some_and(|before| (before - report.machine_deg).abs() > tolerance_deg);
        elsewhere || (was_homed == Some(true) && report.homed == Some(false))
    }

    /// Forgets the position: the controller has restarted.
    fn lose_by_restart(&mut self) {
        self.restarted |= self.zero_deg.take().is_some();
        self.rest_deg = None;
        self.homed = None;
    }

    /// Forgets the position if a stop has lost it.
    fn settle(&mut self) {
        let Some(outcome) = self.stopped() else {
            return;
        };
        if self.is_unapplied && outcome != StopOutcome::Stopped {
            self.zero_deg = None;
        }
        self.changed |= std::mem::take(&mut self.is_unapplied);
    }

    fn on_reset(&mut self, now_us: i64, cause: Option<String>) {
        self.restarts += 1;
        self.alarm = None;
        self.emergency_stop = false;
        let asked_for = cause.as_deref().is_none_or(|cause| cause == HOST_RESET);
        let stop = self.stop.as_mut().filter(|stop| stop.outcome().is_none());
        let kept = stop.is_some_and(|stop| stop.on_reset(now_us)) && asked_for;
        if !kept {
            self.lose_by_restart();
        }
        if !self.is_stopping() && self.motion.is_some() {
            self.fail(now_us, MotionFault::Restarted(cause));
        }
    }

    fn on_alarm(&mut self, now_us: i64, code: u8) {
        self.alarm = Some(code);
        let alarm = self.alarm_of(Some(code));
        if alarm.loses_position() {
            self.zero_deg = None;
        }
        if self.motion.is_some() && !self.is_stopping() {
            self.fail(now_us, MotionFault::Alarm(alarm));
        }
    }
}
