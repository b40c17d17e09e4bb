//! What is made of recorded sessions: masks, their check, the extraction, by the programs relit-mask and
//! relit-extract where they are installed.
//!
//! The `queue` decides what is done when, `events` what a program's words mean, `results` what it made. One thread
//! starts the programs as `child` processes. While the rig captures or moves nothing begins,
//! and what runs is stopped (`SIGSTOP`) until the rig rests. Results lie where the programs leave them, in the session
//! and the data set; only the settings are kept (`store`) here.

mod child;
mod commands;
mod editor;
mod events;
mod queue;
pub(crate) mod results;
mod runner;
mod shared;
mod store;

use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError, mpsc};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

pub use commands::ProcessingPrograms;
pub(crate) use editor::EditorTarget;
pub use shared::ProcessingOptions;

use crate::command::CommandError;
use crate::state::{Monitor, ProcessingStep};
use editor::OpenEditor;
use queue::ProcessingQueue;
use shared::{HELD, Plan, Shared, is_busy};
pub(crate) use store::ProcessingSettings;

/// The data set's name.
const DATASET: &str = "dataset";
/// Longest wait for a cancelled program to end.
const RELEASE: Duration = Duration::from_secs(10);
/// Time between two looks while waiting for that.
const LOOK: Duration = Duration::from_millis(10);

/// Why sessions cannot be processed at all.
#[derive(Debug, thiserror::Error)]
#[error("{what}")]
pub struct ProcessingError {
    what: String,
    source: io::Error,
}

impl ProcessingError {
    fn from_io(what: String) -> impl FnOnce(io::Error) -> Self {
        move |source| Self { what, source }
    }
}

/// Works on sessions until it is dropped.
#[derive(Debug)]
pub struct Processing {
    shared: Arc<Shared>,
    thread: Mutex<Option<JoinHandle<()>>>,
}

impl Processing {
    /// Waits for work. `monitor` says when the rig rests, and shows what is done.
    ///
    /// # Errors
    /// [`ProcessingError`].
    pub fn start(
        root: &Path,
        monitor: Monitor,
        options: ProcessingOptions,
    ) -> Result<Self, ProcessingError> {
        let missing = format!(
            "the folder of sessions {} could not be found",
            root.display()
        );
        let root = root
            .canonicalize()
            .map_err(ProcessingError::from_io(missing))?;
        let settings =
            ProcessingSettings::read(&root).map_err(ProcessingError::from_io(format!(
                "{} could not be read: repair it, or remove it and set its choices again",
                store::path(&root).display()
            )))?;
        let beside = || root.parent().unwrap_or(&root).to_owned();
        let datasets = options.datasets.unwrap_or_else(beside);
        let mut dataset = datasets.join(DATASET);
        if dataset == root {
            dataset.as_mut_os_string().push("-shards");
        }
        let (to_start, starts) = mpsc::sync_channel(1);
        let shared = Arc::new(Shared {
            dataset,
            monitor,
            plan: Mutex::new(Plan {
                queue: ProcessingQueue::default(),
                settings,
                programs: (options.programs)(),
            }),
            editor: Mutex::default(),
            opening: Mutex::default(),
            to_start,
            is_ending: AtomicBool::new(false),
            programs: options.programs,
            root,
        });
        shared.show();
        let worked = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("relit-processing".to_owned())
            .spawn(move || runner::run(&worked, &starts))
            .map_err(ProcessingError::from_io(
                "a thread for processing could not be started".to_owned(),
            ))?;
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
        if self.shared.editor().as_ref().is_some_and(|open| {
            open.session == session && open.is_in_use() && steps.contains(&ProcessingStep::Mask)
        }) {
            let error = format!("the mask of {session} is open in the editor: finish it there");
            return Err(CommandError::Busy(error));
        }
        self.shared.find_programs();
        self.shared.submit(session, steps)
    }

    /// Cancels a job; its program is ended. False if no job has that number.
    pub fn cancel(&self, number: u64) -> bool {
        self.shared.change(|plan| plan.queue.cancel(number))
    }

    /// Changes the settings.
    pub(crate) fn configure(&self, settings: ProcessingSettings) {
        self.shared.find_programs();
        self.shared.change(|plan| plan.settings = settings);
    }

    /// Ends all work on a session, so that its folder can be moved.
    ///
    /// # Errors
    /// [`CommandError::Busy`] if a program does not end.
    pub fn release(&self, session: &str) -> Result<(), CommandError> {
        self.shared.close_editor_of(session);
        self.shared
            .change(|plan| plan.queue.cancel_session(session));
        let until = Instant::now() + RELEASE;
        while self.shared.plan().queue.has(session) {
            if Instant::now() > until {
                let error = format!("{session} is still being processed: try again in a moment");
                return Err(CommandError::Busy(error));
            }
            thread::park_timeout(LOOK);
        }
        Ok(())
    }

    /// Opens the editor of a session's mask, or continues with the one that is open.
    ///
    /// # Errors
    /// [`CommandError`] if the program is missing or fails, the rig is busy, or somebody edits another session.
    pub fn edit(&self, session: &str) -> Result<(), CommandError> {
        if is_busy(&self.shared.monitor) {
            return Err(CommandError::Busy(HELD.to_owned()));
        }
        if self.shared.plan().queue.has(session) {
            let error = format!("{session} is being processed: wait for it, or cancel it");
            return Err(CommandError::Busy(error));
        }
        self.shared.find_programs();
        let programs = self.shared.plan().programs.clone();
        let _opening = self.shared.opening.lock();
        if !self.shared.goes_on(session)? {
            let folder = self.shared.root.join(session);
            let opened = OpenEditor::open(&self.shared, &programs, session, &folder)?;
            *self.shared.editor() = Some(opened);
        }
        self.shared.show();
        Ok(())
    }

    /// Where requests for the editor go.
    ///
    /// # Errors
    /// [`CommandError`] if none is open, or it is held while the rig is busy.
    pub(crate) fn editor(&self) -> Result<EditorTarget, CommandError> {
        if is_busy(&self.shared.monitor) {
            return Err(CommandError::Unavailable(HELD.to_owned()));
        }
        let mut editor = self.shared.editor();
        let none = || "no mask is open in the editor: open one from the list of sessions";
        let open = editor.as_mut();
        let open = open.ok_or_else(|| CommandError::Unavailable(none().to_owned()))?;
        open.touch();
        Ok(open.target.clone())
    }

    /// Ends the editor without a mask.
    pub fn close_editor(&self) {
        *self.shared.editor() = None;
        self.shared.show();
    }

    /// The folder of the data set.
    pub fn dataset(&self) -> PathBuf {
        self.shared.dataset.clone()
    }

    /// Ends the programs, and comes back when that is done. Does nothing the second time.
    pub fn end(&self) {
        self.shared.is_ending.store(true, Ordering::Relaxed);
        let thread = self.thread.lock();
        let thread = thread.unwrap_or_else(PoisonError::into_inner).take();
        if let Some(thread) = thread {
            let _ = thread.join();
        }
        *self.shared.editor() = None;
    }
}

impl Drop for Processing {
    fn drop(&mut self) {
        self.end();
    }
}
