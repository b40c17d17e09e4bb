//! What is made of recorded sessions: masks, their check, the extraction, by the programs relit-mask and
//! relit-extract where they are installed; and the editor of masks.
//!
//! The `queue` decides what is done when, `results` says what a program made. One thread starts each `program`. While
//! the rig captures or moves nothing begins, and a program that runs is stopped (`SIGSTOP`) until the rig rests; what the
//! editor began is finished at low priority. Results lie where
//! the programs leave them, in the session and the data set; only the settings are kept (`store`) here.

mod commands;
mod editor;
mod program;
mod queue;
pub(crate) mod results;
mod store;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use relit_data::causes::with_causes;
use relit_data::session::{Manifest, Status};

pub use commands::ProcessingPrograms;
pub(crate) use store::ProcessingSettings;

use crate::capture::CaptureError;
use crate::command::CommandError;
use crate::state::{Monitor, ProcessingJob, ProcessingState, ProcessingStep, Verdict};
use commands::StepPlaces;
use editor::OpenEditor;
use program::Program;
use queue::{ProcessingQueue, StepOutcome};
use results::{entries_in, results_of};

/// The data set's name.
const DATASET: &str = "dataset";
/// Longest time between two looks at the program and the rig.
const LOOK: Duration = Duration::from_millis(50);
/// What is done with a usable take by itself.
const ALL: [ProcessingStep; 3] = [
    ProcessingStep::Mask,
    ProcessingStep::Check,
    ProcessingStep::Extract,
];

/// Works on sessions until it is dropped.
#[derive(Debug)]
pub struct Processing {
    shared: Arc<Shared>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

/// What those who ask and the thread that works share.
#[derive(Debug)]
struct Shared {
    root: PathBuf,
    /// The folder of the data set.
    dataset: PathBuf,
    programs: ProcessingPrograms,
    monitor: Monitor,
    work: Mutex<Work>,
    editor: Mutex<Option<OpenEditor>>,
    /// Held by who opens an editor, which takes a while.
    opening: Mutex<()>,
    is_ending: AtomicBool,
}

#[derive(Debug)]
struct Work {
    queue: ProcessingQueue,
    /// The program of the job under way.
    program: Option<Program>,
    settings: ProcessingSettings,
}

/// Whether the rig captures or moves, so that nothing may take its processor or disk.
fn is_busy(monitor: &Monitor) -> bool {
    let state = monitor.state();
    !state.rests() || state.table.moves()
}

impl Processing {
    /// Waits for work on the sessions in `root`, by these programs. `monitor` says when the rig rests, and shows what is
    /// done. `datasets` is the folder in which the data set lies; `None`: the one that holds `root`.
    ///
    /// # Errors
    /// [`CaptureError::System`] if the folder or its settings cannot be read, or a thread cannot be started.
    pub fn start(
        root: &Path,
        monitor: Monitor,
        datasets: Option<PathBuf>,
        programs: ProcessingPrograms,
    ) -> Result<Self, CaptureError> {
        let missing = CaptureError::system(root.display().to_string(), "found");
        let root = root.canonicalize().map_err(missing)?;
        let unread = CaptureError::system(store::path(&root).display().to_string(), "read");
        let settings = ProcessingSettings::read(&root).map_err(unread)?;
        let beside = || root.parent().unwrap_or(&root).to_owned();
        let mut dataset = datasets.unwrap_or_else(beside).join(DATASET);
        if dataset == root {
            dataset.as_mut_os_string().push("-shards");
        }
        let shared = Arc::new(Shared {
            dataset,
            programs,
            monitor,
            work: Mutex::new(Work {
                queue: ProcessingQueue::default(),
                program: None,
                settings,
            }),
            editor: Mutex::default(),
            opening: Mutex::default(),
            is_ending: AtomicBool::new(false),
            root,
        });
        shared.show();
        let worker = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("relit-processing".to_owned())
            .spawn(move || worker.run())
            .map_err(CaptureError::system("a thread", "started"))?;
        Ok(Self {
            shared,
            thread: Mutex::new(Some(thread)),
        })
    }

    /// Queues steps for a session; returns the job's number.
    ///
    /// # Errors
    /// [`CommandError`] if a program is missing, or the session is being worked on.
    pub fn submit(&self, session: &str, steps: &[ProcessingStep]) -> Result<u64, CommandError> {
        if steps.contains(&ProcessingStep::Mask) && self.shared.is_edited(session) {
            let error = format!("the mask of {session} is open in the editor: finish it there");
            return Err(CommandError::Busy(error));
        }
        self.shared.submit(session, steps)
    }

    /// Cancels a job; its program is ended. False if no job has that number.
    pub fn cancel(&self, number: u64) -> bool {
        self.shared.cancel(|job| job.number == number)
    }

    /// Changes the settings.
    pub(crate) fn configure(&self, settings: ProcessingSettings) {
        let shared = &self.shared;
        shared.work().settings = settings;
        if let Err(error) = settings.write(&shared.root) {
            let path = store::path(&shared.root);
            shared.note(format!(
                "{} could not be written: {error}; the next start forgets what was set",
                path.display()
            ));
        }
        shared.show();
    }

    /// Ends all work on a session, so that its folder can be moved.
    pub fn release(&self, session: &str) {
        self.shared.editor().take_if(|open| open.session == session);
        self.shared.cancel(|job| job.session == session);
    }

    /// The folder of the data set.
    pub fn dataset(&self) -> &Path {
        &self.shared.dataset
    }

    /// Ends the programs, and comes back when that is done. Does nothing the second time.
    pub fn end(&self) {
        self.shared.is_ending.store(true, Ordering::Relaxed);
        let thread = self.thread.lock();
        let thread = thread.unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            let _ = thread.join();
        }
        self.shared.work().program = None;
        *self.shared.editor() = None;
    }
}

impl Drop for Processing {
    fn drop(&mut self) {
        self.end();
    }
}

impl Shared {
    fn work(&self) -> MutexGuard<'_, Work> {
        self.work.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn note(&self, line: String) {
        self.monitor.update(|state| state.note(line));
    }

    fn submit(&self, session: &str, steps: &[ProcessingStep]) -> Result<u64, CommandError> {
        if let Some(program) = steps.iter().find_map(|&step| self.programs.missing(step)) {
            let error = format!(
                "{program} is not installed on this machine: install the package relit and start this program again, or copy the command"
            );
            return Err(CommandError::Unavailable(error));
        }
        let number = self.work().queue.submit(session, steps);
        self.show();
        number
    }

    fn cancel(&self, which: impl Fn(&ProcessingJob) -> bool) -> bool {
        let mut work = self.work();
        let Some(line) = work.queue.cancel(which) else {
            return false;
        };
        if !work.queue.is_under_way() {
            work.program = None;
        }
        drop(work);
        self.note(line);
        self.show();
        true
    }

    /// Works until the program ends.
    fn run(&self) {
        let mut last_take = self.last_take().0;
        let mut seen = 0;
        while !self.is_ending.load(Ordering::Relaxed) {
            seen = self.monitor.wait_newer(seen, LOOK).version;
            self.look_after_editor();
            self.take_up_what_was_recorded(&mut last_take);
            if let Some(line) = self.go_on(is_busy(&self.monitor)) {
                self.note(line);
            }
            self.show();
        }
    }

    /// The session of the last take, and whether it can be used.
    fn last_take(&self) -> (Option<String>, bool) {
        let take = self.monitor.state().last_take;
        let usable = take.as_ref().map(|take| take.verdict != Verdict::Aborted);
        (take.map(|take| take.session), usable.unwrap_or(false))
    }

    /// Queues a take that has just ended, where that is wanted.
    fn take_up_what_was_recorded(&self, seen: &mut Option<String>) {
        let (session, is_usable) = self.last_take();
        if session == *seen {
            return;
        }
        seen.clone_from(&session);
        let is_wanted = is_usable && self.work().settings.when_done;
        let Some(session) = session.filter(|_| is_wanted) else {
            return;
        };
        let can = |step: &ProcessingStep| self.programs.missing(*step).is_none();
        let steps: Vec<_> = ALL.into_iter().take_while(can).collect();
        // Without the programs the page shows the commands.
        if !steps.is_empty()
            && let Err(refused) = self.submit(&session, &steps)
        {
            self.note(format!("not processed: {refused}"));
        }
    }

    /// Looks after the program under way, or begins what is next; returns what to note about a step that has ended.
    fn go_on(&self, is_busy: bool) -> Option<String> {
        let mut work = self.work();
        let work = &mut *work;
        let Some(program) = &mut work.program else {
            if is_busy {
                return None;
            }
            let job = work.queue.begin()?;
            match self.start(job) {
                Ok(program) => work.program = Some(program),
                Err(why) => return work.queue.finish(StepOutcome::failed(why)),
            }
            return None;
        };
        program.set_held(is_busy);
        work.queue.set_held(is_busy);
        if let Some((done, of)) = program.take_progress() {
            work.queue.advance(done, of);
        }
        let ended = program.ended()?;
        work.program = None;
        let job = work.queue.jobs().next()?;
        let end = self.outcome(job, ended);
        work.queue.finish(end)
    }

    fn start(&self, job: &ProcessingJob) -> Result<Program, String> {
        let session = self.root.join(&job.session);
        let manifest = Manifest::read(&session).map_err(|error| with_causes(&error))?;
        let places = StepPlaces {
            session,
            dataset: self.dataset.clone(),
            is_aborted: matches!(manifest.status, Status::Aborted(_)),
        };
        let command = self.programs.command(job.step, &places);
        let command = command.ok_or("its program is not installed on this machine")?;
        let program = command.get_program().to_string_lossy().into_owned();
        Program::start(command).map_err(|error| format!("{program} could not be started: {error}"))
    }

    /// How a step ended, by what its program said and its files.
    fn outcome(&self, job: &ProcessingJob, ended: Result<(), String>) -> StepOutcome {
        if let Err(why) = ended {
            return StepOutcome::failed(why);
        }
        let results = results_of(&self.root.join(&job.session), &entries_in(&self.dataset));
        let none = || StepOutcome::failed("the program ended without a result".to_owned());
        results.outcome(job.step).unwrap_or_else(none)
    }

    /// Shows how things stand, where that is new.
    fn show(&self) {
        let editing = self.editor().as_ref().map(|open| open.session.clone());
        let shown = {
            let work = self.work();
            ProcessingState {
                has_mask_program: self.programs.mask.is_some(),
                has_extract_program: self.programs.extract.is_some(),
                when_done: work.settings.when_done,
                dataset_folder: self.dataset.display().to_string(),
                jobs: work.queue.jobs().cloned().collect(),
                finished: work.queue.finished(),
                editing,
            }
        };
        if self.monitor.state().processing != shown {
            self.monitor.update(|state| state.processing = shown);
        }
    }
}
