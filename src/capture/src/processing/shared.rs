//! What those who ask for processing and the thread that works share.

use std::path::PathBuf;
use std::process::Command;
use std::sync::atomic::AtomicBool;
use std::sync::mpsc::{self, SyncSender};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::{fmt, io};

use super::child::Worker;
use super::commands::ProcessingPrograms;
use super::editor::OpenEditor;
use super::queue::ProcessingQueue;
use super::store::{self, ProcessingSettings};
use crate::command::CommandError;
use crate::state::{Monitor, ProcessingState, ProcessingStep};

/// Where data sets and programs are.
pub struct ProcessingOptions {
    /// The folder in which data sets lie; `None`: the one that holds the folder of sessions.
    pub datasets: Option<PathBuf>,
    /// Looks for the programs: one that is installed later is found then.
    pub programs: Box<dyn Fn() -> ProcessingPrograms + Send + Sync>,
}

impl fmt::Debug for ProcessingOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut options = f.debug_struct("ProcessingOptions");
        options
            .field("datasets", &self.datasets)
            .finish_non_exhaustive()
    }
}

/// What those who ask and the thread that works share.
pub(super) struct Shared {
    pub(super) root: PathBuf,
    /// The folder of the data set.
    pub(super) dataset: PathBuf,
    pub(super) programs: Box<dyn Fn() -> ProcessingPrograms + Send + Sync>,
    pub(super) monitor: Monitor,
    pub(super) plan: Mutex<Plan>,
    pub(super) editor: Mutex<Option<OpenEditor>>,
    /// Held by who opens an editor, which takes a while.
    pub(super) opening: Mutex<()>,
    /// Programs that the thread that works is to start.
    pub(super) to_start: SyncSender<ToStart>,
    pub(super) is_ending: AtomicBool,
}

impl fmt::Debug for Shared {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Shared").finish_non_exhaustive()
    }
}

/// A program to start, and who waits for it.
pub(super) struct ToStart {
    pub(super) command: Command,
    pub(super) started: SyncSender<io::Result<Worker>>,
}

#[derive(Debug)]
pub(super) struct Plan {
    pub(super) queue: ProcessingQueue,
    pub(super) settings: ProcessingSettings,
    pub(super) programs: ProcessingPrograms,
}

/// The editor's message while the rig is busy.
pub(super) const HELD: &str = "the rig is capturing: the editor continues afterwards";

/// Whether the rig captures or moves, so that nothing may take its processor or disk.
pub(super) fn is_busy(monitor: &Monitor) -> bool {
    let state = monitor.state();
    !state.rests() || state.table.moves()
}

impl Shared {
    pub(super) fn plan(&self) -> MutexGuard<'_, Plan> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn editor(&self) -> MutexGuard<'_, Option<OpenEditor>> {
        self.editor.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn find_programs(&self) {
        let found = (self.programs)();
        self.plan().programs = found;
    }

    /// Starts a program on the thread that works: those of the server have a low priority, which a program inherits.
    pub(super) fn start(&self, command: Command) -> io::Result<Worker> {
        let ending = || io::Error::other("the rig is ending");
        let (started, worker) = mpsc::sync_channel(1);
        let sent = self.to_start.send(ToStart { command, started });
        sent.map_err(|_| ending())?;
        worker.recv().map_err(|_| ending())?
    }

    /// Whether the editor that is open is this session's. One that nobody uses makes room.
    pub(super) fn goes_on(&self, session: &str) -> Result<bool, CommandError> {
        let mut editor = self.editor();
        match editor.as_mut() {
            Some(open) if open.session == session => open.touch(),
            Some(open) if open.is_in_use() => {
                let other = &open.session;
                let error =
                    format!("the mask of {other} is being edited: finish or close it there");
                return Err(CommandError::Busy(error));
            }
            _ => {
                *editor = None;
                return Ok(false);
            }
        }
        Ok(true)
    }

    pub(super) fn close_editor_of(&self, session: &str) {
        let mut editor = self.editor();
        if editor.as_ref().is_some_and(|open| open.session == session) {
            *editor = None;
        }
    }

    pub(super) fn submit(
        &self,
        session: &str,
        steps: &[ProcessingStep],
    ) -> Result<u64, CommandError> {
        self.change(|plan| {
            let missing_program = |step: &ProcessingStep| plan.missing_program(*step);
            if let Some(program) = steps.iter().find_map(missing_program) {
                let error = format!("{program} is not installed on this machine: install the package relit, or copy the command");
                return Err(CommandError::Unavailable(error));
            }
            plan.queue.submit(session, steps)
        })
    }

    /// Changes the plan, saves what is to outlast the program, and shows the result.
    pub(super) fn change<T>(&self, change: impl FnOnce(&mut Plan) -> T) -> T {
        let mut plan = self.plan();
        let before = plan.settings;
        let done = change(&mut plan);
        let after = plan.settings;
        drop(plan);
        if before != after
            && let Err(error) = after.write(&self.root)
        {
            let path = store::path(&self.root);
            self.monitor.update(|state| {
                state.note(format!(
                    "{} could not be written: {error}; the next start forgets what was set",
                    path.display()
                ));
            });
        }
        self.show();
        done
    }

    /// Shows how things stand, where that is new.
    pub(super) fn show(&self) {
        let editing = self.editor().as_ref().map(|open| open.session.clone());
        let shown = {
            let plan = self.plan();
            ProcessingState {
                has_mask_program: plan.programs.mask.is_some(),
                has_extract_program: plan.programs.extract.is_some(),
                when_done: plan.settings.when_done,
                dataset_folder: self.dataset.display().to_string(),
                jobs: plan.queue.jobs().cloned().collect(),
                finished: plan.queue.finished(),
                editing,
            }
        };
        if self.monitor.state().processing != shown {
            self.monitor.update(|state| state.processing = shown);
        }
    }
}

impl Plan {
    /// The program that a step needs and that is not installed.
    pub(super) fn missing_program(&self, step: ProcessingStep) -> Option<&'static str> {
        match step {
            ProcessingStep::Mask | ProcessingStep::Check => {
                self.programs.mask.is_none().then_some("relit-mask")
            }
            ProcessingStep::Extract => self.programs.extract.is_none().then_some("relit-extract"),
        }
    }
}
