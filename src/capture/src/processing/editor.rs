//! The editor of masks, for one session at a time. While the rig is busy it takes no requests.

use std::fmt;
use std::sync::{MutexGuard, PoisonError, TryLockError};
use std::time::{Duration, Instant};

use axum::Router;
use relit_data::causes::with_causes;
use relit_data::session::MASK_FILE;
use relit_grabcut::{Hints, SegmentSettings};
use relit_mask::{MaskEditor, MaskRequest, MaskingError};

use super::{Processing, Shared, is_busy};
use crate::command::CommandError;

/// An editor that nobody used for so long is closed.
const UNUSED: Duration = Duration::from_secs(15 * 60);
/// Somebody who used it within this time is still at it.
const IN_USE: Duration = Duration::from_secs(60);
/// The editor's message while the rig is busy.
const HELD: &str = "the rig is capturing: the editor continues afterwards";

/// An editor that is open.
pub(super) struct OpenEditor {
    pub(super) session: String,
    editor: MaskEditor,
    used: Instant,
}

impl fmt::Debug for OpenEditor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "OpenEditor({})", self.session)
    }
}

impl OpenEditor {
    fn is_in_use(&self) -> bool {
        self.editor.is_working() || self.used.elapsed() < IN_USE
    }
}

impl Processing {
    /// Opens the editor of a session's mask, or continues with the one that is open.
    ///
    /// # Errors
    /// [`CommandError`] if it cannot be opened, the rig is busy, or somebody edits another session.
    pub fn edit(&self, session: &str) -> Result<(), CommandError> {
        let shared = &self.shared;
        if is_busy(&shared.monitor) {
            return Err(CommandError::Busy(HELD.to_owned()));
        }
        if shared.work().queue.has(session) {
            let error = format!("{session} is being processed: wait for it, or cancel it");
            return Err(CommandError::Busy(error));
        }
        let opening = shared.opening.try_lock();
        if let Err(TryLockError::WouldBlock) = opening {
            let error = "a mask is being opened in the editor: try again in a moment";
            return Err(CommandError::Busy(error.to_owned()));
        }
        if !shared.goes_on(session)? {
            let editor = shared.open_editor(session).map_err(|error| {
                let why = with_causes(&error);
                CommandError::Unavailable(format!("the editor did not open: {why}"))
            })?;
            *shared.editor() = Some(OpenEditor {
                session: session.to_owned(),
                editor,
                used: Instant::now(),
            });
        }
        shared.show();
        Ok(())
    }

    /// What answers requests for the editor.
    ///
    /// # Errors
    /// [`CommandError`] if none is open, or the rig is busy.
    pub(crate) fn editor(&self) -> Result<Router, CommandError> {
        if is_busy(&self.shared.monitor) {
            return Err(CommandError::Unavailable(HELD.to_owned()));
        }
        let mut editor = self.shared.editor();
        let none = || "no mask is open in the editor: open one from the list of sessions";
        let open = editor.as_mut();
        let open = open.ok_or_else(|| CommandError::Unavailable(none().to_owned()))?;
        open.used = Instant::now();
        Ok(open.editor.router())
    }

    /// Closes the editor without a mask.
    pub fn close_editor(&self) {
        *self.shared.editor() = None;
        self.shared.show();
    }
}

impl Shared {
    pub(super) fn editor(&self) -> MutexGuard<'_, Option<OpenEditor>> {
        self.editor.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether somebody is drawing this session's mask.
    pub(super) fn is_edited(&self, session: &str) -> bool {
        let editor = self.editor();
        let open = editor.as_ref().filter(|open| open.is_in_use());
        open.is_some_and(|open| open.session == session)
    }

    /// The editor continues with the mask as it was made, if there is one.
    fn open_editor(&self, session: &str) -> Result<MaskEditor, MaskingError> {
        let folder = self.root.join(session);
        let recipe = folder.join(MASK_FILE).with_extension("json");
        let request = if recipe.is_file() {
            MaskRequest::from_recipe(&recipe)?
        } else {
            MaskRequest::new(0, Hints::default(), SegmentSettings::default()).by_turn()
        };
        MaskEditor::open(&folder, None, &request)
    }

    /// Whether the editor that is open is this session's. One that nobody uses makes room.
    fn goes_on(&self, session: &str) -> Result<bool, CommandError> {
        let mut editor = self.editor();
        match editor.as_mut() {
            Some(open) if open.session == session => open.used = Instant::now(),
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

    /// Closes the editor once its mask is accepted or discarded, or nobody has used it for long.
    pub(super) fn look_after_editor(&self) {
        let is_busy = is_busy(&self.monitor);
        let over = |open: &mut OpenEditor| {
            // It continues after a capture, however long that takes.
            if is_busy {
                open.used = Instant::now();
            }
            open.editor.is_over() || open.used.elapsed() >= UNUSED
        };
        let closed = self.editor().take_if(over);
        if let Some(closed) = closed
            && closed.editor.accepted().is_some()
        {
            self.work().queue.forget_masks(&closed.session);
        }
    }
}
