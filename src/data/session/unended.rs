//! A session whose recorder died, and its end.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::writer::{close, keep_as_found, write_index};
use super::{Claim, Error, FrameIndex, INDEX_FILE, IndexFault, MANIFEST_FILE, Manifest, Status};

/// A session whose recorder died: marked as recording, and claimed by nobody else.
#[derive(Debug)]
pub struct Unended {
    folder: PathBuf,
    manifest: Manifest,
    index: FrameIndex,
    fault: Option<IndexFault>,
    claim: Claim,
}

impl Unended {
    /// Claims a session and reads what stands there, the index as far as it is whole.
    ///
    /// # Errors
    /// [`Error::InUse`] where its recorder lives, [`Error::Ended`] where it has ended,
    /// [`Error::Manifest`], or what the file system answers.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        let claim = Claim::take(folder)?;
        let path = folder.join(MANIFEST_FILE);
        let bytes = fs::read(&path).map_err(Error::io(&path, "read"))?;
        let manifest =
            Manifest::from_json(&bytes).map_err(|fault| Error::Manifest { path, fault })?;
        if manifest.status != Status::Recording {
            claim.end()?;
            return Err(Error::Ended(folder.to_owned()));
        }
        claim.release_reserve()?;
        let path = folder.join(INDEX_FILE);
        let lines = match fs::read(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
            read => read.map_err(Error::io(path, "read"))?,
        };
        let (index, fault) = FrameIndex::parse_as_far_as_whole(&lines);
        Ok(Self {
            folder: folder.to_owned(),
            manifest,
            index,
            fault,
            claim,
        })
    }

    /// The video's path.
    #[must_use]
    pub fn video_path(&self) -> PathBuf {
        self.folder.join(&self.manifest.video.file)
    }

    /// The index as far as it is whole.
    #[must_use]
    pub fn index(&self) -> &FrameIndex {
        &self.index
    }

    /// What is wrong in the index behind that.
    #[must_use]
    pub fn index_fault(&self) -> Option<&IndexFault> {
        self.fault.as_ref()
    }

    /// Marks the session as aborted for this reason, with the first `frames` lines of the index. Where
    /// lines have to go for that, the index as found stays beside it, `frames.interrupted.jsonl`.
    ///
    /// # Errors
    /// What the file system answers; the status stays "recording" then.
    pub fn abort(mut self, frames: usize, reason: &str) -> Result<Manifest, Error> {
        if self.fault.is_some() || frames < self.index.entries().len() {
            keep_as_found(&self.folder)?;
            self.index.truncate(frames);
            write_index(&self.folder, &self.index)?;
        }
        let frames = self.index.entries().len() as u64;
        let status = Status::Aborted(reason.to_owned());
        let manifest = close(&self.folder, self.manifest, frames, status)?;
        self.claim.end()?;
        Ok(manifest)
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::super::writer::INDEX_AS_FOUND;
    use super::super::writer::tests::{entry, writer};
    use super::*;

    #[test]
    fn a_session_is_claimed_while_its_writer_lives_and_no_longer() {
        let root = tempfile::tempdir().unwrap();
        let live = writer(root.path());
        let folder = live.folder().to_owned();
        assert!(matches!(Unended::open(&folder), Err(Error::InUse(_))));
        drop(live);
        let manifest = Unended::open(&folder)
            .unwrap()
            .abort(0, "interrupted")
            .unwrap();
        assert_eq!(manifest.status, Status::Aborted("interrupted".to_owned()));
        assert!(matches!(Unended::open(&folder), Err(Error::Ended(_))));
        let names = fs::read_dir(&folder).unwrap();
        let mut names: Vec<_> = names.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, [INDEX_FILE, MANIFEST_FILE]);
    }

    #[test]
    fn an_index_that_is_cut_stays_as_it_was_found_under_another_name() {
        let root = tempfile::tempdir().unwrap();
        let mut live = writer(root.path());
        (0..5).for_each(|n| live.push(entry(n)).unwrap());
        let folder = live.folder().to_owned();
        let mut lines = fs::OpenOptions::new();
        let mut lines = lines.append(true).open(folder.join(INDEX_FILE)).unwrap();
        lines.write_all(&[0; 30]).unwrap();
        drop(live);
        let found = fs::read(folder.join(INDEX_FILE)).unwrap();
        let unended = Unended::open(&folder).unwrap();
        assert_eq!(unended.index().entries().len(), 5);
        assert!(unended.index_fault().is_some());
        let manifest = unended.abort(3, "interrupted").unwrap();
        assert_eq!(manifest.video.frames, Some(3));
        let cut = FrameIndex::parse(&fs::read(folder.join(INDEX_FILE)).unwrap()).unwrap();
        assert_eq!(cut.entries(), [0, 1, 2].map(entry));
        assert_eq!(fs::read(folder.join(INDEX_AS_FOUND)).unwrap(), found);
    }
}
