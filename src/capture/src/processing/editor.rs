//! The editor of masks: `relit-mask --edit`, reachable on this machine alone, for one session at a time.

use std::net::SocketAddr;
use std::path::Path;
use std::time::{Duration, Instant};
use std::{fs, thread};

use relit_data::session::MASK_FILE;

use super::child::Worker;
use super::commands::ProcessingPrograms;
use super::events::ProgramEvent;
use super::shared::{Shared, is_busy};
use crate::command::CommandError;

/// Time in which the editor has to come up: it reads the video through once.
const START: Duration = Duration::from_secs(60);
/// An editor that nobody used for so long is ended.
const UNUSED: Duration = Duration::from_secs(15 * 60);
/// Somebody who used it within this time is still at it.
const IN_USE: Duration = Duration::from_secs(60);
/// Time between two looks at it.
const LOOK: Duration = Duration::from_millis(20);

/// Where requests for the editor go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct EditorTarget {
    /// Its address, on this machine.
    pub address: SocketAddr,
    /// What it demands.
    pub token: String,
}

impl EditorTarget {
    /// Of what the editor says of itself.
    pub(super) fn parse(address: &str, url: &str) -> Option<Self> {
        let (_, token) = url.split_once("?token=")?;
        Some(Self {
            address: address.parse().ok()?,
            token: token.to_owned(),
        })
    }
}

/// An editor that is open.
#[derive(Debug)]
pub(super) struct OpenEditor {
    pub(super) session: String,
    pub(super) target: EditorTarget,
    worker: Worker,
    heard: ProgramEvent,
    used: Instant,
}

impl OpenEditor {
    /// Starts the editor of a session's mask and waits until it can be reached. It is held while the rig is busy.
    pub(super) fn open(
        shared: &Shared,
        programs: &ProcessingPrograms,
        session: &str,
        folder: &Path,
    ) -> Result<Self, CommandError> {
        let recipe = recipe(folder);
        let command = programs.editor(folder, recipe.as_deref());
        let missing =
            || CommandError::Unavailable("relit-mask is not installed on this machine".to_owned());
        let failed =
            |why: String| CommandError::Unavailable(format!("the editor did not open: {why}"));
        let started = shared.start(command.ok_or_else(missing)?);
        let mut worker = started.map_err(|error| failed(error.to_string()))?;
        let mut heard = ProgramEvent::default();
        let until = Instant::now() + START;
        loop {
            worker.set_paused(is_busy(&shared.monitor));
            worker.read_events(&mut heard);
            if let Some(target) = heard.editor() {
                return Ok(Self {
                    session: session.to_owned(),
                    target: target.clone(),
                    worker,
                    heard,
                    used: Instant::now(),
                });
            }
            match worker.ended(&mut heard) {
                Ok(None) if Instant::now() < until => thread::park_timeout(LOOK),
                Ok(None) => return Err(failed("it took too long".to_owned())),
                Ok(Some(status)) => {
                    let error_output = worker.error_output();
                    return Err(failed(heard.failure(status.code(), &error_output)));
                }
                Err(error) => return Err(failed(error.to_string())),
            }
        }
    }

    /// Somebody uses it.
    pub(super) fn touch(&mut self) {
        self.used = Instant::now();
    }

    /// Whether somebody used it a moment ago.
    pub(super) fn is_in_use(&self) -> bool {
        self.used.elapsed() < IN_USE
    }

    /// Holds it while the rig is busy. False once it is over: accepted, discarded, or abandoned.
    pub(super) fn poll(&mut self, held: bool) -> bool {
        self.worker.read_events(&mut self.heard);
        self.worker.set_paused(held);
        let is_running = matches!(self.worker.ended(&mut self.heard), Ok(None));
        is_running && self.used.elapsed() < UNUSED
    }

    /// The session, if a mask of it was accepted.
    pub(super) fn masked_session(&self) -> Option<&str> {
        self.heard.has_mask().then_some(&*self.session)
    }
}

/// How the mask was made, where the editor can go on with that.
fn recipe(folder: &Path) -> Option<std::path::PathBuf> {
    let path = folder.join(MASK_FILE).with_extension("json");
    let is_there = fs::metadata(&path).is_ok_and(|file| file.is_file());
    is_there.then_some(path)
}
