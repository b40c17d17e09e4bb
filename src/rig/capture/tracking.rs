//! The time in which a take's frames are recorded: the table turns, the recorder is told when the
//! turn is, and both are watched.

use std::time::{Duration, Instant};

use super::failure::CaptureError;
use super::preflight;
use super::shoot::Onlookers;
use super::{Recorder, Stage, Window};
use crate::clock::Clock;
use crate::daemon::idle::show_table;
use crate::state::Phase;
use crate::turntable::{self, ConstantPart, ControllerState, Table, Track, Turn, TurnPlan};

/// How long the newest frame is waited for in one go: how often everything is looked at.
const GLANCE: Duration = Duration::from_millis(20);
/// How often the monitor is told of progress.
const TELLING: Duration = Duration::from_millis(100);
/// What is left after the announcement of a turn without table before it begins, microseconds.
const LEAD_US: i64 = 200_000;
/// How long after the turn's last frame was due the recording may take to end, of real time.
const END_PATIENCE: Duration = Duration::from_secs(10);

/// A recording under way, and what it is for.
pub(super) struct Course<'a> {
    pub(super) recorder: &'a Recorder,
    pub(super) clock: Clock,
    /// The time of 360 degrees, microseconds.
    pub(super) turn_us: i64,
    pub(super) on: Onlookers<'a>,
}

impl Course<'_> {
    /// Turns the table and records its turn; gives the angles. The table is back where it stood,
    /// or, where something failed, stands where it was stopped.
    pub(super) fn with_table(&self, table: &Table, plan: TurnPlan) -> Result<Track, CaptureError> {
        self.on.stop.over(table, || self.turn(table, plan))
    }

    fn turn(&self, table: &Table, plan: TurnPlan) -> Result<Track, CaptureError> {
        self.enter(Phase::MovingBack);
        self.show_unwatched_motion();
        let margin_us = preflight::margin_us(&plan);
        let mut turn = self.or_stopped(table.start_turn(plan))?;
        self.enter(Phase::Starting);
        let part = self.or_stopped(turn.wait_constant())?;
        let window = self.window(part, margin_us);
        self.recorder.announce(window);
        self.enter(Phase::Recording);
        if !self.watch(window, &mut turn, table)? {
            turn.abort()?;
            return Err(CaptureError::EndedEarly);
        }
        self.enter(Phase::Unwinding);
        self.show_unwatched_motion();
        self.or_stopped(turn.wait_end())
    }

    fn window(&self, part: ConstantPart, margin_us: i64) -> Window {
        let from_us = part.from_us.saturating_add(margin_us);
        Window::lasting(from_us, self.turn_us)
    }

    /// Looks at recorder and table until the recording has ended; false where that was before the
    /// turn's end.
    fn watch(
        &self,
        window: Window,
        turn: &mut Turn<'_>,
        table: &Table,
    ) -> Result<bool, CaptureError> {
        let mut look = Look::default();
        loop {
            self.on.stop.check()?;
            self.or_stopped(turn.state())?;
            if self.recorder.progress().stage == Stage::Ended {
                return Ok(self.clock.now_us() >= window.to_us());
            }
            let late = self.clock.now_us().saturating_sub(window.to_us());
            if self.clock.real(micros(late)) > END_PATIENCE {
                return Ok(false);
            }
            self.look(&mut look, Some(table));
        }
    }

    /// Records as long as a turn takes, from now on.
    pub(super) fn without_table(&self) -> Result<(), CaptureError> {
        let from_us = self.clock.now_us().saturating_add(LEAD_US);
        let window = Window::lasting(from_us, self.turn_us);
        self.recorder.announce(window);
        self.enter(Phase::Recording);
        let mut look = Look::default();
        while self.recorder.progress().stage != Stage::Ended {
            self.on.stop.check()?;
            let late = self.clock.now_us().saturating_sub(window.to_us());
            if self.clock.real(micros(late)) > END_PATIENCE {
                return Err(CaptureError::EndedEarly);
            }
            self.look(&mut look, None);
        }
        Ok(())
    }

    /// Shows the newest frame, and tells how far it is.
    fn look(&self, look: &mut Look, table: Option<&Table>) {
        let newest = self.recorder.preview().newer_than(look.seen, GLANCE);
        if let Some((number, frame)) = newest {
            look.seen = number;
            if let Some(viewer) = self.on.viewer {
                viewer.offer(&frame);
            }
        }
        if look.told.is_some_and(|told| told.elapsed() < TELLING) {
            return;
        }
        look.told = Some(Instant::now());
        let progress = self.recorder.progress();
        self.on.monitor.update(|state| {
            state.frames = progress.frames;
            state.dropped = progress.overrun;
        });
        if let Some(table) = table {
            // A table that does not answer ends the turn, which is watched elsewhere.
            let _shown = show_table(self.on.monitor, table);
        }
    }

    /// The table moves, and nobody looks at its reports until it is there.
    fn show_unwatched_motion(&self) {
        self.on.monitor.update(|state| {
            state.table.state = ControllerState::Run.to_string();
            state.table.angle_deg = None;
            state.table.degrees_per_second = None;
        });
    }

    fn enter(&self, phase: Phase) {
        self.on.monitor.update(|state| state.phase = phase);
    }

    /// What the table answers; a stop that was asked for explains it better.
    fn or_stopped<T>(
        &self,
        answer: Result<T, turntable::TurntableError>,
    ) -> Result<T, CaptureError> {
        match answer {
            Ok(value) => Ok(value),
            Err(error) => {
                self.on.stop.check()?;
                Err(error.into())
            }
        }
    }
}

/// What was seen and told last.
#[derive(Default)]
struct Look {
    seen: u64,
    told: Option<Instant>,
}

fn micros(us: i64) -> Duration {
    Duration::from_micros(u64::try_from(us).unwrap_or(0))
}
