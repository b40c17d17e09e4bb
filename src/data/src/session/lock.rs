//! The lock on a session folder: a file that the recorder keeps locked. The system releases the lock
//! of a process that dies, so a session that is marked as recording and not locked was interrupted.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::SessionError;

/// Name of the file that a recorder keeps locked.
const LOCK_FILE: &str = ".recording";
/// Bytes kept in reserve, so that manifest and index can still be written on a full disk.
const RESERVE: usize = 512 << 10;

/// The lock on a session folder, and some disk space reserved for the end of the session. Dropping it
/// releases the lock and leaves the file.
#[derive(Debug)]
pub(super) struct SessionLock {
    path: PathBuf,
    file: File,
}

impl SessionLock {
    /// Locks a session folder.
    ///
    /// # Errors
    /// [`SessionError::InUse`] if another process holds the lock, or [`SessionError::Io`].
    pub(super) fn acquire(folder: &Path) -> Result<Self, SessionError> {
        let path = folder.join(LOCK_FILE);
        let mut options = OpenOptions::new();
        let opened = options.create(true).truncate(false).write(true).open(&path);
        let file = opened.map_err(SessionError::io(&path, "made"))?;
        match file.try_lock() {
            Ok(()) => Ok(Self { path, file }),
            Err(TryLockError::WouldBlock) => Err(SessionError::InUse(folder.to_owned())),
            Err(TryLockError::Error(source)) => Err(SessionError::io(path, "locked")(source)),
        }
    }

    /// Reserves disk space for what is written last.
    pub(super) fn reserve(&mut self) -> Result<(), SessionError> {
        let written = self.file.write_all(&vec![0; RESERVE]);
        written
            .and_then(|()| self.file.sync_all())
            .map_err(SessionError::io(&self.path, "written"))
    }

    /// Frees the reserved disk space.
    pub(super) fn release_reserve(&self) -> Result<(), SessionError> {
        let cut = self.file.set_len(0);
        cut.map_err(SessionError::io(&self.path, "written"))
    }

    /// Releases the lock and removes its file: nobody records in this folder any more.
    pub(super) fn remove(self) -> Result<(), SessionError> {
        match fs::remove_file(&self.path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(SessionError::io(&self.path, "removed")(error))
            }
            _ => Ok(()),
        }
    }
}
