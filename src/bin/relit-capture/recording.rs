//! `relit-capture record`: one capture, for a person or a machine.

use std::fs;
use std::io::{self, IsTerminal};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use relit_rig::capture::{
    CaptureError, Equipment, Exclusive, Onlookers, Order, Settings, StopRequest, Stopped, capture,
    salvage,
};
use relit_rig::state::{Monitor, Phase, RigState, TakeSummary, Verdict};
use relit_rig::turntable::TurntableAddress;
use serde_json::json;

use crate::arguments::Record;
use crate::environment::at_end;
use relit::console::{Console, Outcome};

/// How often progress is looked at.
const GLANCE: Duration = Duration::from_millis(100);

pub(crate) fn run(console: Console, record: Record) -> Result<Outcome, CaptureError> {
    let Record {
        settings,
        object,
        meter,
        yes,
    } = record;
    make_root(&settings)?;
    if !yes && matches!(settings.turntable, TurntableAddress::Serial(_)) && !agreed(console)? {
        console.warn("the table was not turned: nobody agreed; --yes agrees beforehand");
        return Ok(Outcome::Wrong);
    }
    let _camera = Exclusive::camera(&settings)?;
    tell_salvaged(console, &settings)?;
    let stop = StopRequest::default();
    let asked = stop.clone();
    at_end(move || asked.ask(Stopped::Shutdown)).map_err(system("the signals", "listened to"))?;
    let mut equipment = Equipment::new(settings)?;
    let monitor = Monitor::default();
    let order = Order { object, meter };
    let taken = while_telling(console, &monitor, || {
        let on = Onlookers {
            monitor: &monitor,
            viewer: None,
            stop: &stop,
        };
        capture(&mut equipment, &order, on)
    })?;
    let root = equipment.settings().root.join(&taken.session);
    Ok(tell(console, &taken, &root.display().to_string()))
}

fn system(what: &'static str, doing: &'static str) -> impl FnOnce(io::Error) -> CaptureError {
    move |source| CaptureError::System {
        what: what.to_owned(),
        doing,
        source,
    }
}

fn make_root(settings: &Settings) -> Result<(), CaptureError> {
    fs::create_dir_all(&settings.root).map_err(|source| CaptureError::System {
        what: settings.root.display().to_string(),
        doing: "made",
        source,
    })
}

/// Asks the person at the terminal; where there is none, nobody agrees.
fn agreed(console: Console) -> Result<bool, CaptureError> {
    if !io::stdin().is_terminal() {
        return Ok(false);
    }
    console.ask(
        "The table will look for its zero and turn once. Is its way and its cable free? [y/N] ",
    );
    let mut answer = String::new();
    let read = io::stdin().read_line(&mut answer);
    read.map_err(system("the answer", "read"))?;
    Ok(matches!(answer.trim(), "y" | "Y" | "yes"))
}

fn tell_salvaged(console: Console, settings: &Settings) -> Result<(), CaptureError> {
    for found in salvage(&settings.root)? {
        let folder = found.folder.display();
        console.warn(&match found.saved {
            Ok(saved) => format!("{folder} was interrupted, and is kept as aborted: {saved}"),
            Err(error) => format!("{folder} was interrupted and could not be salvaged: {error}"),
        });
    }
    Ok(())
}

/// Runs `work` while another thread tells what the monitor shows.
fn while_telling<T>(console: Console, monitor: &Monitor, work: impl FnOnce() -> T) -> T {
    let over = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut teller = Teller::new(console);
            while !over.load(Ordering::Relaxed) {
                teller.tell(&monitor.wait_newer(teller.version, GLANCE));
            }
            teller.tell(&monitor.state());
            teller.bar.finish_and_clear();
        });
        let done = work();
        over.store(true, Ordering::Relaxed);
        done
    })
}

/// What was told of a capture.
struct Teller {
    console: Console,
    bar: indicatif::ProgressBar,
    version: u64,
    phase: Phase,
    checks: usize,
    faults: usize,
}

impl Teller {
    fn new(console: Console) -> Self {
        Self {
            console,
            bar: indicatif::ProgressBar::hidden(),
            version: 0,
            phase: Phase::Idle,
            checks: 0,
            faults: 0,
        }
    }

    fn tell(&mut self, state: &RigState) {
        self.version = state.version;
        if state.checks.len() < self.checks {
            self.checks = 0;
        }
        for check in state.checks.iter().skip(self.checks) {
            let mark = if check.good { "ok" } else { "note" };
            self.console.say(
                &format!("{mark:>4}  {}: {}", check.what, check.found),
                &json!({ "event": "check", "what": check.what, "good": check.good, "found": check.found }),
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
            _ => indicatif::ProgressBar::hidden(),
        };
        self.console.say_phase(
            words(state.phase),
            &json!({ "event": "phase", "phase": state.phase }),
        );
    }
}

fn words(phase: Phase) -> &'static str {
    match phase {
        Phase::Idle | Phase::WaitingForObject => "waiting",
        Phase::Preflight => "checking camera, table and disk",
        Phase::Metering => "metering: the table turns slowly",
        Phase::MovingBack => "the table goes back by its ramp",
        Phase::Starting => "the table gathers speed",
        Phase::Recording => "recording",
        Phase::Unwinding => "the table goes back to where it began",
        Phase::Checking => "checking the take",
    }
}

fn tell(console: Console, taken: &TakeSummary, folder: &str) -> Outcome {
    let (judgement, outcome) = match taken.verdict {
        Verdict::Clean => ("clean", Outcome::Whole),
        Verdict::Tolerated => ("whole, with remarks", Outcome::Lossy),
        Verdict::Aborted => ("not usable, kept as aborted", Outcome::Wrong),
    };
    let reason = taken
        .reason
        .as_ref()
        .map_or(String::new(), |reason| format!(": {reason}"));
    console.say(
        &format!(
            "{folder}: {} frames, {} dropped, {judgement}{reason}",
            taken.frames, taken.dropped
        ),
        &json!({ "event": "done", "session": folder, "take": taken }),
    );
    outcome
}
