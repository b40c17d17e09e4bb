//! `relit-capture record`: one capture, for a person or a machine.

use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use relit_capture::capture::{
    CaptureContext, CaptureError, CaptureOutcome, Equipment, Settings, StopReason, StopRequest,
    capture, recover,
};
use relit_capture::state::{Monitor, Phase, RigState, Verdict};
use relit_turntable::TurntableAddress;
use serde_json::json;

use super::arguments::RecordArguments;
use super::environment::at_end;
use relit_console::{Console, Event, Outcome};
use relit_data::durable::CreatedFolder;

/// How often progress is looked at.
const UPDATE: Duration = Duration::from_millis(100);

pub(crate) fn run(console: Console, record: RecordArguments) -> Result<Outcome, CaptureError> {
    let RecordArguments { object, turn } = record;
    let settings: Settings = turn.rig.into();
    let _made = make_root(&settings)?;
    report_recovered(console, &settings)?;
    let mut equipment = Equipment::new(settings)?;
    // Without a camera there is nothing to agree to.
    equipment.open_camera()?;
    if !turn.yes && !agreed(console, equipment.settings())? {
        return Ok(Outcome::Failure);
    }
    let stop = StopRequest::new(&equipment.clock());
    let asked = stop.clone();
    at_end(move || asked.request(StopReason::Shutdown))
        .map_err(CaptureError::system("the signals", "listened to"))?;
    let monitor = Monitor::default();
    let context = CaptureContext {
        monitor: &monitor,
        preview: None,
        stop: &stop,
    };
    let captured = while_reporting(console, &monitor, || {
        capture(&mut equipment, &object, context)
    })?;
    let folder = equipment.settings().root.join(&captured.take.session);
    Ok(report(console, &captured, &folder.display().to_string()))
}

/// Makes the folder of sessions; one that stays empty is removed at the end.
pub(crate) fn make_root(settings: &Settings) -> Result<CreatedFolder, CaptureError> {
    let root = settings.root.display().to_string();
    if settings.root.to_str().is_none() {
        return Err(CaptureError::Refused(format!(
            "the folder {root} has a name that is not plain text, and videos in it cannot be read: give another one"
        )));
    }
    CreatedFolder::make(&settings.root).map_err(CaptureError::system(root, "made"))
}

/// Asks the person at the terminal whether a real table may turn; without a terminal the answer is no.
pub(crate) fn agreed(console: Console, settings: &Settings) -> Result<bool, CaptureError> {
    if !matches!(settings.turntable, TurntableAddress::Serial(_)) {
        return Ok(true);
    }
    let mut answer = String::new();
    if io::stdin().is_terminal() {
        console
            .ask("The table will find its zero and turn. Can it and its cable move freely? [y/N] ");
        let read = io::stdin().read_line(&mut answer);
        read.map_err(CaptureError::system("the answer", "read"))?;
    }
    let agreed = matches!(answer.trim(), "y" | "Y" | "yes");
    if !agreed {
        console.warn("the table was not turned: nobody confirmed; --yes confirms beforehand");
    }
    Ok(agreed)
}

fn report_recovered(console: Console, settings: &Settings) -> Result<(), CaptureError> {
    let recovered = recover(&settings.root)?;
    recovered
        .iter()
        .for_each(|found| console.warn(&found.to_string()));
    Ok(())
}

/// Says that the work is over, also where it panics: the scope waits for the other thread.
struct Over<'a>(&'a AtomicBool);

impl Drop for Over<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Runs `work` while another thread reports what the monitor shows.
fn while_reporting<T>(console: Console, monitor: &Monitor, work: impl FnOnce() -> T) -> T {
    let over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut reporter = Reporter::new(console);
            while !over.load(Ordering::Relaxed) {
                reporter.report(&monitor.wait_newer(reporter.version, UPDATE));
            }
            reporter.report(&monitor.state());
            reporter.bar.finish_and_clear();
        });
        let _over = Over(&over);
        work()
    })
}

/// What was reported of a capture so far.
struct Reporter {
    console: Console,
    bar: relit_console::ProgressBar,
    version: u64,
    phase: Phase,
    checks: usize,
    faults: usize,
}

impl Reporter {
    fn new(console: Console) -> Self {
        Self {
            console,
            bar: relit_console::ProgressBar::hidden(),
            version: 0,
            phase: Phase::Idle,
            checks: 0,
            faults: 0,
        }
    }

    fn report(&mut self, state: &RigState) {
        self.version = state.version;
        if state.checks.len() < self.checks {
            self.checks = 0;
        }
        for check in state.checks.iter().skip(self.checks) {
            let mark = if check.good { "ok" } else { "note" };
            self.console.print(
                &format!("{mark:>4}  {}: {}", check.what, check.found),
                &Event::Check(relit_console::Check::Rig {
                    what: check.what.clone(),
                    good: check.good,
                    found: check.found.clone(),
                }),
            );
        }
        self.checks = state.checks.len();
        for fault in state.faults.iter().skip(self.faults) {
            self.console.warn(&fault.what);
        }
        self.faults = state.faults.len();
        if state.phase != self.phase {
            self.phase = state.phase;
            self.enter(state);
        }
        self.bar.set_position(state.frames);
    }

    fn enter(&mut self, state: &RigState) {
        self.bar.finish_and_clear();
        self.bar = match state.phase {
            Phase::Recording => {
                let label = state.session.clone().unwrap_or_default();
                self.console.progress(state.frames_wanted, &label)
            }
            _ => relit_console::ProgressBar::hidden(),
        };
        self.console.print_phase(
            &state.phase.to_string(),
            &Event::Phase {
                phase: json!(state.phase),
            },
        );
    }
}

fn report(console: Console, captured: &CaptureOutcome, folder: &str) -> Outcome {
    let take = &captured.take;
    let (verdict, outcome) = judgement(captured);
    let reason = take.reason.as_ref();
    let reason = reason.map_or(String::new(), |reason| format!(": {reason}"));
    console.print(
        &format!(
            "{folder}: {} frames, {} dropped, {verdict}{reason}",
            take.frames, take.dropped
        ),
        &Event::Done(relit_console::Done::Capture {
            session: folder.to_owned(),
            take: json!(take),
        }),
    );
    outcome
}

/// What a capture is worth, in words and as an exit code.
fn judgement(captured: &CaptureOutcome) -> (&'static str, Outcome) {
    match captured.take.verdict {
        Verdict::Clean if captured.repeated == 0 => ("clean", Outcome::Success),
        Verdict::Clean => ("clean, after an unusable take", Outcome::Partial),
        Verdict::Tolerated => ("whole, with remarks", Outcome::Partial),
        Verdict::Aborted => ("unusable, kept as aborted", Outcome::Failure),
    }
}

#[cfg(test)]
mod tests {
    use relit_capture::state::TakeSummary;

    use super::*;

    #[test]
    fn only_a_clean_first_take_ends_without_a_remark() {
        for (verdict, repeated, outcome) in [
            (Verdict::Clean, 0, Outcome::Success),
            (Verdict::Clean, 1, Outcome::Partial),
            (Verdict::Tolerated, 0, Outcome::Partial),
            (Verdict::Tolerated, 1, Outcome::Partial),
            (Verdict::Aborted, 0, Outcome::Failure),
            (Verdict::Aborted, 1, Outcome::Failure),
        ] {
            let take = TakeSummary {
                session: String::new(),
                verdict,
                frames: 0,
                dropped: 0,
                is_stopped: false,
                reason: None,
                notes: Vec::new(),
            };
            assert_eq!(judgement(&CaptureOutcome { take, repeated }).1, outcome);
        }
    }
}
