//! Recovery of a session whose recorder died.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::writer::{close, keep_backup, write_index};
use super::{FrameIndex, INDEX_FILE, Manifest, SessionError, SessionLock, Status, TurnJournal};

/// A session that is marked as recording although its recorder has died. It stays locked while this
/// value lives.
#[derive(Debug)]
pub struct InterruptedSession {
    folder: PathBuf,
    manifest: Manifest,
    index: FrameIndex,
    /// Whether the index has a fault, up to which it was read.
    is_faulty: bool,
    journal: Option<TurnJournal>,
    lock: SessionLock,
}

impl InterruptedSession {
    /// Locks a session and reads it, the index up to its first fault.
    ///
    /// # Errors
    /// [`SessionError::InUse`] if its recorder is still running, [`SessionError::Ended`] if it has ended,
    /// [`SessionError::Unusable`], or [`SessionError::Io`].
    pub fn open(folder: &Path) -> Result<Self, SessionError> {
        let lock = SessionLock::acquire(folder)?;
        let manifest = Manifest::read(folder)?;
        if manifest.status != Status::Recording {
            lock.remove()?;
            return Err(SessionError::Ended(folder.to_owned()));
        }
        lock.release_reserve()?;
        let path = folder.join(INDEX_FILE);
        let lines = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            read => read.map_err(SessionError::io(path, "read"))?,
        };
        let (index, fault) = FrameIndex::parse_until_fault(&lines);
        Ok(Self {
            folder: folder.to_owned(),
            manifest,
            index,
            is_faulty: fault.is_some(),
            journal: TurnJournal::read(folder),
            lock,
        })
    }

    /// The video's path.
    pub fn video_path(&self) -> PathBuf {
        self.folder.join(&self.manifest.video.file)
    }

    /// The index up to its first fault.
    pub fn index(&self) -> &FrameIndex {
        &self.index
    }

    /// What the turntable reported of the turn, if there was one.
    pub fn journal(&self) -> Option<&TurnJournal> {
        self.journal.as_ref()
    }

    /// Marks the session as aborted for this reason, with the first `frames` lines of the index. A
    /// frame without angle gets the one (degrees) that `angle` returns for its time stamp
    /// (microseconds). If lines are removed, the index is kept as it was found in
    /// `frames.interrupted.jsonl`.
    ///
    /// # Errors
    /// [`SessionError::Io`]; the status then stays "recording".
    pub fn abort(
        mut self,
        frames: usize,
        angle: &dyn Fn(i64) -> Option<f64>,
        reason: &str,
    ) -> Result<Manifest, SessionError> {
        let is_cut = self.is_faulty || frames < self.index.entries().len();
        if is_cut {
            keep_backup(&self.folder)?;
            self.index.truncate(frames);
        }
        if self.index.add_angles(angle) || is_cut {
            write_index(&self.folder, &self.index)?;
        }
        let frames = self.index.entries().len() as u64;
        let status = Status::Aborted(reason.to_owned());
        let manifest = close(&self.folder, self.manifest, frames, status)?;
        self.lock.remove()?;
        Ok(manifest)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::super::MANIFEST_FILE;
    use super::super::writer::INDEX_AS_FOUND;
    use super::super::writer::{entry, writer};
    use super::*;

    #[test]
    fn a_session_is_locked_while_its_writer_lives_and_no_longer() {
        let root = tempfile::tempdir().unwrap();
        let live = writer(root.path());
        let folder = live.folder().to_owned();
        let open = || InterruptedSession::open(&folder);
        assert!(matches!(open(), Err(SessionError::InUse(_))));
        drop(live);
        let manifest = open().unwrap().abort(0, &|_| None, "interrupted").unwrap();
        assert_eq!(manifest.status, Status::Aborted("interrupted".to_owned()));
        assert!(matches!(open(), Err(SessionError::Ended(_))));
        let names = fs::read_dir(&folder).unwrap();
        let mut names: Vec<_> = names.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, [INDEX_FILE, MANIFEST_FILE]);
    }

    #[test]
    fn an_index_that_is_truncated_is_kept_as_it_was_found_under_another_name() {
        let root = tempfile::tempdir().unwrap();
        let mut live = writer(root.path());
        (0..5).for_each(|n| live.push(entry(n)).unwrap());
        let folder = live.folder().to_owned();
        let mut lines = fs::OpenOptions::new();
        let mut lines = lines.append(true).open(folder.join(INDEX_FILE)).unwrap();
        lines.write_all(&[0; 30]).unwrap();
        drop(live);
        let found = fs::read(folder.join(INDEX_FILE)).unwrap();
        let session = InterruptedSession::open(&folder).unwrap();
        assert_eq!(session.index().entries().len(), 5);
        assert!(session.is_faulty);
        let manifest = session.abort(3, &|_| None, "interrupted").unwrap();
        assert_eq!(manifest.video.frames, Some(3));
        let cut = FrameIndex::parse(&fs::read(folder.join(INDEX_FILE)).unwrap()).unwrap();
        assert_eq!(cut.entries(), [0, 1, 2].map(entry));
        assert_eq!(fs::read(folder.join(INDEX_AS_FOUND)).unwrap(), found);
    }
}
