//! Writing a session folder while it is recorded.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::journal::JournalWriter;
use super::recording::video_missing;
use super::{
    FrameEntry, FrameIndex, INDEX_FILE, MANIFEST_FILE, Manifest, SessionError, SessionLock, Status,
    TurnJournal, is_session_name,
};
use crate::durable;
use crate::naming::not_a_name;
use crate::turn_motion::{JournaledReport, JournaledTurn};

/// Name under which the original index is kept if lines of it are removed.
pub(super) const INDEX_AS_FOUND: &str = "frames.interrupted.jsonl";

/// A session folder that is being recorded. The manifest says "recording" until [`Self::finish`] or
/// [`Self::abort`]. A writer that is dropped leaves it so, for the next start of a capture to find
/// ([`InterruptedSession`](super::InterruptedSession)). The folder is locked while the writer lives:
/// see `lock`.
#[derive(Debug)]
pub struct SessionWriter {
    folder: PathBuf,
    manifest: Manifest,
    index: FrameIndex,
    lines: File,
    /// Bytes of the complete lines in the index file.
    length: u64,
    /// True if entries were amended since their lines were written.
    rewrite: bool,
    /// True if frames were removed whose lines are in the file.
    truncated: bool,
    journal: Option<JournalWriter>,
    lock: SessionLock,
}

impl SessionWriter {
    /// Creates the folder `root/<id>` with a manifest whose status is "recording". The status and the
    /// video's figures in `manifest` are ignored: they are set at the end.
    ///
    /// # Errors
    /// [`SessionError::Unusable`] if there is such a session, its name is not one, or the manifest could not be read
    /// back; or [`SessionError::Io`].
    pub fn create(root: &Path, mut manifest: Manifest) -> Result<Self, SessionError> {
        if !is_session_name(&manifest.id) {
            return Err(SessionError::Unusable(not_a_name(&manifest.id)));
        }
        let folder = root.join(&manifest.id);
        match fs::create_dir(&folder) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                let what = "exists already: a session never replaces another one";
                return Err(SessionError::unusable(&folder, what));
            }
            made => made.map_err(SessionError::io(&folder, "made"))?,
        }
        durable::sync_folder(root).map_err(SessionError::io(root, "synced"))?;
        // Locked before the manifest exists, so that the session never looks interrupted.
        let mut lock = SessionLock::acquire(&folder)?;
        lock.reserve()?;
        manifest.status = Status::Recording;
        manifest.video.frames = None;
        manifest.video.bytes = None;
        manifest.video.blake3 = None;
        write_manifest(&folder, &manifest)?;
        let path = folder.join(INDEX_FILE);
        let lines = OpenOptions::new()
            .create_new(true)
            .append(true)
            .open(&path)
            .map_err(SessionError::io(path, "made"))?;
        durable::sync_folder(&folder).map_err(SessionError::io(&folder, "synced"))?;
        Ok(Self {
            folder,
            manifest,
            index: FrameIndex::default(),
            lines,
            length: 0,
            rewrite: false,
            truncated: false,
            journal: None,
            lock,
        })
    }

    /// The session folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Path at which the video has to be written.
    pub fn video_path(&self) -> PathBuf {
        self.folder.join(&self.manifest.video.file)
    }

    /// The manifest, to add faults and what became known after the start.
    pub fn manifest_mut(&mut self) -> &mut Manifest {
        &mut self.manifest
    }

    /// Appends a frame's line to the index.
    ///
    /// # Errors
    /// [`SessionError::Unusable`] if it does not continue the index, or [`SessionError::Io`]. The index is then
    /// unchanged, and the same entry may be pushed again.
    pub fn push(&mut self, entry: FrameEntry) -> Result<(), SessionError> {
        let pushed = self.index.push(entry);
        pushed.map_err(|fault| self.bad_entry(entry.n, &fault))?;
        let written = self.append_line(&entry);
        if written.is_err() {
            self.remove_last();
        }
        written.map_err(SessionError::io(self.folder.join(INDEX_FILE), "written"))
    }

    fn bad_entry(&self, n: u64, fault: &str) -> SessionError {
        let path = self.folder.join(INDEX_FILE);
        SessionError::Unusable(format!(
            "frame {n} cannot follow in {}: {fault}",
            path.display()
        ))
    }

    /// Writes an entry's line after the last complete one.
    fn append_line(&mut self, entry: &FrameEntry) -> io::Result<()> {
        let mut line = serde_json::to_vec(entry).map_err(io::Error::other)?;
        line.push(b'\n');
        self.drop_partial_line()?;
        self.lines.write_all(&line)?;
        self.length += line.len() as u64;
        Ok(())
    }

    /// Truncates the file to its complete lines, in case the last write failed half-way.
    fn drop_partial_line(&self) -> io::Result<()> {
        self.lines.set_len(self.length)
    }

    /// Removes the last entry, whose line could not be written.
    fn remove_last(&mut self) {
        // If truncating fails now, it is repeated before the next line and before a sync.
        let _ = self.drop_partial_line();
        self.index
            .truncate(self.index.entries().len().saturating_sub(1));
    }

    /// Starts the journal of the turn. Without one, or where it cannot be written, an interrupted
    /// session has no angles; nothing else depends on it.
    pub fn begin_journal(&mut self, turn: JournaledTurn) {
        self.journal = JournalWriter::create(&self.folder, turn).ok();
    }

    /// Adds a report of the table to the journal, if there is one.
    pub fn add_report(&mut self, report: JournaledReport) {
        if let Some(journal) = &mut self.journal
            && journal.add(report).is_err()
        {
            self.journal = None;
        }
    }

    /// The journal so far.
    pub fn journal(&self) -> Option<&TurnJournal> {
        self.journal.as_ref().map(JournalWriter::journal)
    }

    /// The index so far.
    pub fn index(&self) -> &FrameIndex {
        &self.index
    }

    /// Changes entries after their lines were written, for example to add the angle. The file is
    /// rewritten, whole or not at all, when the session ends.
    ///
    /// # Errors
    /// [`SessionError::Unusable`] for the first invalid entry; then none is changed.
    pub fn amend(
        &mut self,
        amended: impl Fn(&FrameEntry) -> FrameEntry,
    ) -> Result<(), SessionError> {
        let mut index = FrameIndex::default();
        for entry in self.index.entries() {
            let entry = amended(entry);
            let pushed = index.push(entry);
            pushed.map_err(|fault| self.bad_entry(entry.n, &fault))?;
        }
        self.rewrite |= index != self.index;
        self.index = index;
        Ok(())
    }

    /// Removes all frames from position `frames` on, which the video does not have. When the session
    /// ends, the original index is kept as `frames.interrupted.jsonl`.
    pub fn truncate(&mut self, frames: usize) {
        if frames < self.index.entries().len() {
            self.index.truncate(frames);
            self.truncated = true;
        }
    }

    /// Syncs the index to disk, up to the last frame pushed, and the journal.
    ///
    /// # Errors
    /// [`SessionError::Io`].
    pub fn sync(&self) -> Result<(), SessionError> {
        if let Some(journal) = &self.journal {
            // The index is what a session cannot do without.
            let _ = journal.sync();
        }
        self.drop_partial_line()
            .and_then(|()| self.lines.sync_data())
            .map_err(SessionError::io(self.folder.join(INDEX_FILE), "synced"))
    }

    /// Ends a complete session: adds the video's size, hash and number of frames to the manifest and
    /// marks it complete. The video must have been closed.
    ///
    /// # Errors
    /// [`SessionError::Unusable`] if the video is missing, or [`SessionError::Io`]; the status then stays "recording".
    pub fn finish(self) -> Result<Manifest, SessionError> {
        self.end(Status::Complete)
    }

    /// Marks an incomplete session as aborted, with this reason. What was recorded stays.
    ///
    /// # Errors
    /// As [`Self::finish`].
    pub fn abort(self, reason: &str) -> Result<Manifest, SessionError> {
        self.end(Status::Aborted(reason.to_owned()))
    }

    fn end(self, status: Status) -> Result<Manifest, SessionError> {
        // On a full disk this frees the space for what follows.
        self.lock.release_reserve()?;
        self.sync()?;
        if self.truncated {
            keep_backup(&self.folder)?;
        }
        if self.rewrite || self.truncated {
            write_index(&self.folder, &self.index)?;
        }
        let frames = self.index.entries().len() as u64;
        let manifest = close(&self.folder, self.manifest, frames, status)?;
        if let Some(journal) = self.journal.filter(|_| manifest.status == Status::Complete) {
            // One that stays behind does no harm.
            let _ = journal.remove();
        }
        self.lock.remove()?;
        Ok(manifest)
    }
}

/// Keeps the index as it is under a second name, unless an earlier attempt did so.
pub(super) fn keep_backup(folder: &Path) -> Result<(), SessionError> {
    let (path, kept) = (folder.join(INDEX_FILE), folder.join(INDEX_AS_FOUND));
    if kept.exists() || !path.exists() {
        return Ok(());
    }
    // Not every file system has hard links.
    let linked = fs::hard_link(&path, &kept).or_else(|_| fs::copy(&path, &kept).map(|_| ()));
    linked.map_err(SessionError::io(kept, "written"))
}

/// Adds the video's size and hash to the manifest and writes it with its final status.
pub(super) fn close(
    folder: &Path,
    mut manifest: Manifest,
    frames: u64,
    status: Status,
) -> Result<Manifest, SessionError> {
    let path = folder.join(&manifest.video.file);
    // A capture that failed before its first frame is aborted without a video.
    if path.is_file() {
        let file = File::open(&path).map_err(SessionError::io(&path, "read"))?;
        file.sync_all().map_err(SessionError::io(&path, "synced"))?;
        let mut hasher = blake3::Hasher::new();
        let hashed = hasher
            .update_reader(file)
            .map_err(SessionError::io(&path, "read"))?;
        manifest.video.bytes = Some(hashed.count());
        manifest.video.blake3 = Some(hashed.finalize().to_hex().to_string());
    } else if status == Status::Complete {
        return Err(video_missing(&path));
    }
    manifest.status = status;
    manifest.video.frames = Some(frames);
    write_manifest(folder, &manifest)?;
    Ok(manifest)
}

pub(super) fn write_index(folder: &Path, index: &FrameIndex) -> Result<(), SessionError> {
    let path = folder.join(INDEX_FILE);
    let bytes = index.to_jsonl().map_err(io::Error::other);
    bytes
        .and_then(|bytes| durable::write_whole(&path, &bytes))
        .map_err(SessionError::io(&path, "written"))
}

fn write_manifest(folder: &Path, manifest: &Manifest) -> Result<(), SessionError> {
    let path = folder.join(MANIFEST_FILE);
    let bytes = manifest.to_json();
    let bytes = bytes.map_err(|fault| SessionError::manifest(&path, &fault))?;
    durable::write_whole(&path, &bytes).map_err(SessionError::io(path, "written"))
}

#[cfg(test)]
pub(super) use tests::{entry, writer};

#[cfg(test)]
mod tests {
    use super::*;

    pub(in crate::session) fn writer(root: &Path) -> SessionWriter {
        let json = br#"{
            "schema": "relit.session/1", "id": "20261120T093015Z-mug", "object": "mug",
            "created": "2026-11-20T09:30:15Z", "status": "recording",
            "camera": {"backend": "replay", "device": "", "name": "", "fourcc": "MJPG",
                       "width": 4, "height": 4, "fps": 30.0, "controls": {}},
            "turntable": null,
            "video": {"file": "video.mkv", "codec": "mjpeg"},
            "faults": [],
            "software": {"version": "1", "commit": ""}
        }"#;
        SessionWriter::create(root, Manifest::from_json(json).unwrap()).unwrap()
    }

    pub(in crate::session) fn entry(n: u64) -> FrameEntry {
        FrameEntry {
            n,
            sequence: n,
            t_us: n as i64,
            angle_deg: None,
        }
    }

    #[test]
    fn a_line_that_was_not_written_completely_is_removed_and_can_be_pushed_again() {
        let root = tempfile::tempdir().unwrap();
        let mut writer = writer(root.path());
        writer.push(entry(0)).unwrap();
        let path = writer.folder().join(INDEX_FILE);
        let whole = std::mem::replace(&mut writer.lines, File::open(&path).unwrap());
        assert!(matches!(
            writer.push(entry(1)),
            Err(SessionError::Io { .. })
        ));
        writer.lines = whole;
        writer.lines.write_all(b"{\"n\":1,\"seq").unwrap();
        writer.push(entry(1)).unwrap();
        writer.lines.write_all(b"{\"n\":2,").unwrap();
        writer.sync().unwrap();
        let index = FrameIndex::parse(&fs::read(path).unwrap()).unwrap();
        assert!(!index.is_truncated());
        assert_eq!(index.entries(), [entry(0), entry(1)]);
        assert_eq!(writer.index, index);
    }

    fn with_angle(entry: &FrameEntry) -> FrameEntry {
        FrameEntry {
            angle_deg: Some(entry.n as f64),
            ..*entry
        }
    }

    #[test]
    fn amended_entries_are_in_the_index_once_the_session_ends() {
        let root = tempfile::tempdir().unwrap();
        let mut writer = writer(root.path());
        writer.push(entry(0)).unwrap();
        writer.push(entry(1)).unwrap();
        fs::write(writer.video_path(), b"two frames").unwrap();
        let path = writer.folder().join(INDEX_FILE);
        let wrong = |entry: &FrameEntry| FrameEntry { n: 7, ..*entry };
        let error = writer.amend(wrong).unwrap_err();
        assert!(matches!(error, SessionError::Unusable(_)), "{error:?}");
        assert!(error.to_string().contains("frame 7 "), "{error}");
        writer.amend(with_angle).unwrap();
        writer.finish().unwrap();
        let index = FrameIndex::parse(&fs::read(path).unwrap()).unwrap();
        assert_eq!(
            index.entries(),
            [entry(0), entry(1)].map(|e| with_angle(&e))
        );
    }
}
