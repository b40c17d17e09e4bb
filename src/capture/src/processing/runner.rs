//! The thread that has the programs do the work, one after the other, while the rig rests.

use std::sync::atomic::Ordering;
use std::sync::mpsc::Receiver;
use std::time::{Duration, Instant};

use relit_data::causes::with_causes;
use relit_data::session::{Manifest, Status};

use super::child::Worker;
use super::commands::StepPlaces;
use super::editor::OpenEditor;
use super::events::ProgramEvent;
use super::queue::StepOutcome;
use super::results::{entries_in, results_of};
use super::shared::{Shared, ToStart, is_busy};
use crate::state::{Monitor, ProcessingJob, ProcessingStep, Verdict};

/// Longest time between two looks at the program and the rig.
const LOOK: Duration = Duration::from_millis(50);
/// Time between two searches for the programs.
const SEARCH: Duration = Duration::from_secs(5);
/// What is done with a usable take by itself.
const ALL: [ProcessingStep; 3] = [
    ProcessingStep::Mask,
    ProcessingStep::Check,
    ProcessingStep::Extract,
];

/// The step under way.
struct Running {
    begun: ProcessingJob,
    worker: Worker,
    heard: ProgramEvent,
}

/// Works until the program ends.
pub(super) fn run(shared: &Shared, starts: &Receiver<ToStart>) {
    let mut running: Option<Running> = None;
    let mut last_take = last_take(&shared.monitor).0;
    let mut searched = Instant::now();
    let mut seen = 0;
    while !shared.is_ending.load(Ordering::Relaxed) {
        seen = shared.monitor.wait_newer(seen, LOOK).version;
        for ToStart { command, started } in starts.try_iter() {
            // Who waited has gone: the program ends with its worker.
            let _ = started.send(Worker::start(command));
        }
        if searched.elapsed() > SEARCH {
            searched = Instant::now();
            shared.find_programs();
            shared.show();
        }
        let is_busy = is_busy(&shared.monitor);
        shared.plan().queue.set_rig_busy(is_busy);
        look_after_editor(shared, is_busy);
        take_up_what_was_recorded(shared, &mut last_take);
        running = match running.take() {
            Some(running) => go_on(shared, running),
            None => begin(shared),
        };
        shared.show();
    }
}

fn look_after_editor(shared: &Shared, is_busy: bool) {
    let mut editor = shared.editor();
    let over = editor.take_if(|open| !open.poll(is_busy));
    drop(editor);
    if let Some(session) = over.as_ref().and_then(OpenEditor::masked_session) {
        shared.change(|plan| plan.queue.forget_masks(session));
    }
}

/// The last take's session, and whether it can be used.
fn last_take(monitor: &Monitor) -> (Option<String>, bool) {
    let take = monitor.state().last_take;
    let usable = take.as_ref().map(|take| take.verdict != Verdict::Aborted);
    (take.map(|take| take.session), usable.unwrap_or(false))
}

/// Queues a take that has just ended, where that is wanted.
fn take_up_what_was_recorded(shared: &Shared, seen: &mut Option<String>) {
    let (session, is_usable) = last_take(&shared.monitor);
    if session == *seen {
        return;
    }
    seen.clone_from(&session);
    let is_wanted = is_usable && shared.plan().settings.when_done;
    let Some(session) = session.filter(|_| is_wanted) else {
        return;
    };
    let steps = {
        let plan = shared.plan();
        let can = |step: &ProcessingStep| plan.missing_program(*step).is_none();
        ALL.into_iter().take_while(can).collect::<Vec<_>>()
    };
    // Without the programs the page shows the commands.
    if !steps.is_empty()
        && let Err(refused) = shared.submit(&session, &steps)
    {
        shared
            .monitor
            .update(|state| state.note(format!("not processed: {refused}")));
    }
}

/// Begins what is next, if the rig leaves time for it.
fn begin(shared: &Shared) -> Option<Running> {
    let begun = shared.plan().queue.begin()?;
    match start(shared, &begun) {
        Ok(worker) => Some(Running {
            begun,
            worker,
            heard: ProgramEvent::default(),
        }),
        Err(why) => {
            finish(shared, &begun, StepOutcome::failed(why));
            None
        }
    }
}

fn start(shared: &Shared, begun: &ProcessingJob) -> Result<Worker, String> {
    let session = shared.root.join(&begun.session);
    let manifest = Manifest::read(&session).map_err(|error| with_causes(&error))?;
    let (programs, dataset) = {
        let plan = shared.plan();
        (plan.programs.clone(), shared.dataset.clone())
    };
    let places = StepPlaces {
        session,
        dataset,
        is_aborted: matches!(manifest.status, Status::Aborted(_)),
    };
    let command = programs.command(begun.step, &places);
    let command = command.ok_or("its program is not installed on this machine")?;
    let program = command.get_program().to_string_lossy().into_owned();
    Worker::start(command).map_err(|error| format!("{program} could not be started: {error}"))
}

/// Hears the program, holds or ends it, and notes its end.
fn go_on(shared: &Shared, mut running: Running) -> Option<Running> {
    let (should_pause, is_cancelled) = {
        let plan = shared.plan();
        (plan.queue.should_pause(), plan.queue.is_cancelled())
    };
    if is_cancelled {
        running.worker.end();
    } else {
        running.worker.set_paused(should_pause);
    }
    running.worker.read_events(&mut running.heard);
    if let Some((done, of)) = running.heard.take_progress() {
        shared.plan().queue.advance(done, of);
    }
    let status = match running.worker.ended(&mut running.heard) {
        Ok(None) => return Some(running),
        Ok(Some(status)) => status.code(),
        Err(_) => None,
    };
    let end = outcome(shared, &running, status);
    finish(shared, &running.begun, end);
    None
}

/// How the program under way ended, by its exit code and its files.
fn outcome(shared: &Shared, running: &Running, exit_code: Option<i32>) -> StepOutcome {
    let ProcessingJob { session, step, .. } = &running.begun;
    let made = running.heard.is_success(exit_code).then(|| {
        let entries = entries_in(&shared.dataset);
        results_of(&shared.root.join(session), &entries).outcome(*step)
    });
    made.flatten().unwrap_or_else(|| {
        let error_output = running.worker.error_output();
        StepOutcome::failed(running.heard.failure(exit_code, &error_output))
    })
}

fn finish(shared: &Shared, begun: &ProcessingJob, end: StepOutcome) {
    let what = shared.change(|plan| plan.queue.finish(end));
    let line = format!("{}: {}: {what}", begun.session, begun.step);
    shared.monitor.update(|state| state.note(line));
}
