//! Who records a session: a file in its folder that the recorder keeps locked. The system frees the
//! lock of a process that dies, however it dies, so that a session that is marked as recording and
//! whose claim is free was interrupted.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::Error;

/// Name of the file that a recorder keeps locked.
const CLAIM_FILE: &str = ".recording";
/// Bytes kept in reserve: on a full disk, manifest and index can still be written.
const RESERVE: usize = 512 << 10;

/// The lock on a session folder, and some room on the disk kept for its end. Dropped, it is freed,
/// and the file stays.
#[derive(Debug)]
pub struct Claim {
    path: PathBuf,
    file: File,
}

impl Claim {
    /// Claims a session folder.
    ///
    /// # Errors
    /// [`Error::InUse`] where another holds it, or what the file system answers.
    pub fn take(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(CLAIM_FILE);
        let mut options = OpenOptions::new();
        let opened = options.create(true).truncate(false).write(true).open(&path);
        let file = opened.map_err(Error::io(&path, "made"))?;
        match file.try_lock() {
            Ok(()) => Ok(Self { path, file }),
            Err(TryLockError::WouldBlock) => Err(Error::InUse(folder.to_owned())),
            Err(TryLockError::Error(source)) => Err(Error::io(path, "locked")(source)),
        }
    }

    /// Takes room on the disk for what is written last.
    pub(super) fn reserve(&mut self) -> Result<(), Error> {
        let written = self.file.write_all(&vec![0; RESERVE]);
        written
            .and_then(|()| self.file.sync_all())
            .map_err(Error::io(&self.path, "written"))
    }

    /// Gives the room back to the disk.
    pub(super) fn release_reserve(&self) -> Result<(), Error> {
        let cut = self.file.set_len(0);
        cut.map_err(Error::io(&self.path, "written"))
    }

    /// Frees the folder and takes the file away: nobody records there any more.
    pub(super) fn end(self) -> Result<(), Error> {
        match fs::remove_file(&self.path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(Error::io(&self.path, "removed")(error))
            }
            _ => Ok(()),
        }
    }
}
