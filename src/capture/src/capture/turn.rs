//! The turn of a take: the table turns, the recorder gets the time of the turn, and both are
//! watched.

use std::time::Duration;

use super::context::CaptureContext;
use super::error::CaptureError;
use super::preflight;
use super::recording::{Recorder, Window};
use crate::state::{Monitor, Obstacle, Phase, TableState};
use relit_data::causes::with_causes;
use relit_data::clock::Clock;
use relit_turntable::{
    AngleFit, ControllerState, FinishedTurn, MotionFault, Table, TableStatus, Turn, TurnPlan,
    TurntableError,
};

/// How often table and state are looked at while frames are recorded.
const LOOK: Duration = Duration::from_millis(100);
/// Time between the announcement of a turn without table and its beginning, microseconds.
const LEAD_US: i64 = 200_000;
/// How long after the turn's last frame was due the recording may take to end.
const END_WAIT: Duration = Duration::from_secs(10);

/// The recording of one turn.
pub(super) struct TurnRecording<'a> {
    pub(super) recorder: &'a Recorder,
    pub(super) clock: Clock,
    /// The time of 360 degrees, microseconds.
    pub(super) turn_us: i64,
    pub(super) context: CaptureContext<'a>,
}

impl TurnRecording<'_> {
    /// Turns the table and records its turn; returns the angles. The table rests then at the end of
    /// the turn, or, where something failed, stands where it was stopped.
    pub(super) fn with_table<'t>(
        &self,
        table: &'t Table,
        plan: TurnPlan,
    ) -> Result<(Result<AngleFit, TurntableError>, FinishedTurn<'t>), CaptureError> {
        let stop = self.context.stop;
        stop.explain(stop.over(table, || self.turn(table, plan)))
    }

    /// Records as long as a turn takes, from now on.
    pub(super) fn without_table(&self) -> Result<(), CaptureError> {
        self.record_from(self.clock.now_us().saturating_add(LEAD_US), || Ok(()))
    }

    fn turn<'t>(
        &self,
        table: &'t Table,
        plan: TurnPlan,
    ) -> Result<(Result<AngleFit, TurntableError>, FinishedTurn<'t>), CaptureError> {
        enter_without_reports(self.context, Phase::MovingBack);
        let margin_us = preflight::margin_us(&plan);
        let mut turn = table.start_turn(plan)?;
        self.context.enter(Phase::Starting);
        let constant_us = turn.wait_constant()?;
        let from_us = constant_us.saturating_add(margin_us);
        self.recorder.begin_journal(turn.expected());
        let mut seen = 0;
        let recorded = self.record_from(from_us, || {
            turn.check()?;
            seen = self.keep_journal(&turn, seen);
            // A table that does not answer ends the turn, as its state shows the next time.
            let _shown = show_table(self.context.monitor, table);
            Ok(())
        });
        match recorded {
            // All frames are there: what becomes of the table from here on is no fault of the take.
            Ok(()) => {
                self.keep_journal(&turn, seen);
                Ok(turn.wait_rest())
            }
            Err(error @ CaptureError::NotWithTheTurn) => {
                turn.abort()?;
                Err(error)
            }
            Err(error) => Err(error),
        }
    }

    /// Hands the reports after the first `seen` to the journal; returns how many there are now.
    fn keep_journal(&self, turn: &Turn<'_>, seen: usize) -> usize {
        let (reports, all) = turn.reports_after(seen);
        for report in reports {
            self.recorder.add_report(report);
        }
        all
    }

    /// Records a turn that begins at `from_us`; `check` looks at the table now and then.
    fn record_from(
        &self,
        from_us: i64,
        mut check: impl FnMut() -> Result<(), CaptureError>,
    ) -> Result<(), CaptureError> {
        let window = Window::lasting(from_us, self.turn_us);
        self.recorder.announce(window);
        self.context.enter(Phase::Recording);
        loop {
            self.context.stop.check()?;
            check()?;
            let ended = self.recorder.wait_ended(LOOK);
            self.show_progress();
            let late_us = self.clock.now_us().saturating_sub(window.to_us);
            let late = Duration::from_micros(u64::try_from(late_us).unwrap_or(0));
            match ended {
                true if late_us >= 0 => return Ok(()),
                false if late <= END_WAIT => {}
                _ => return Err(CaptureError::NotWithTheTurn),
            }
        }
    }

    fn show_progress(&self) {
        let progress = self.recorder.progress();
        self.context.monitor.update(|state| {
            state.frames = progress.frames;
            state.dropped = progress.overrun;
        });
    }
}

/// Turns the table back after a turn. What goes wrong is a fault of the table: the take stands.
pub(super) fn unwind(
    table: &Table,
    finished: FinishedTurn<'_>,
    clock: &Clock,
    context: CaptureContext<'_>,
) -> Result<(), CaptureError> {
    enter_without_reports(context, Phase::Unwinding);
    let stop = context.stop;
    let unwound = stop.explain(stop.over(table, || finished.unwind()));
    if let Err(error) = &unwound {
        let why = with_causes(error);
        let what = format!("the table did not turn back after the take: {why}; check its cable");
        if matches!(error, CaptureError::Stopped(_)) {
            context.monitor.update(|state| state.note(what));
        } else {
            context.monitor.fault(clock.now_us(), what);
        }
    }
    unwound
}

/// Enters a phase in which the table moves, and its reports are not shown until it is there.
fn enter_without_reports(context: CaptureContext<'_>, phase: Phase) {
    context.monitor.update(|state| {
        state.phase = phase;
        state.table.state = ControllerState::Run.to_string();
        state.table.angle_deg = None;
        state.table.degrees_per_second = None;
    });
}

/// What is wrong with the table, in a sentence.
fn fault_of(status: &TableStatus, has_index: bool) -> Option<String> {
    if status.emergency_stop {
        return Some(Obstacle::emergency_stop().to_string());
    }
    let lost = || match (has_index, status.homed) {
        // Without an index sensor only a person sees whether the cable is wound.
        (false, false) => Some(preflight::ZERO_NOT_SET.to_owned()),
        _ => status
            .restarted
            .then(|| MotionFault::Restarted(None).to_string()),
    };
    status.alarm.map(|alarm| alarm.to_string()).or_else(lost)
}

/// Asks the table and shows its answer.
pub(crate) fn show_table(monitor: &Monitor, table: &Table) -> Result<(), TurntableError> {
    let status = table.status()?;
    let (low_deg, high_deg) = table.limits(&status);
    let has_index = table.identity().homing;
    monitor.update(|state| {
        let degrees_per_second = state.settings.degrees_per_second;
        state.table = TableState {
            present: true,
            state: status.state.to_string(),
            angle_deg: Some(status.angle_deg),
            degrees_per_second: Some(status.degrees_per_second),
            max_degrees_per_second: Some(table.identity().max_degrees_per_second),
            has_index,
            homed: status.homed,
            battery_v: status.battery_v,
            low_deg: Some(low_deg),
            high_deg: Some(high_deg),
            no_room: preflight::no_room(table, &status, degrees_per_second),
            emergency_stop: status.emergency_stop,
            locked: status.state == ControllerState::Alarm,
            fault: fault_of(&status, has_index),
        };
    });
    Ok(())
}
