//! Writing a session folder while it is recorded.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::{
    Claim, Error, FrameEntry, FrameIndex, INDEX_FILE, MANIFEST_FILE, Manifest, Status,
    is_session_name,
};
use crate::durable;

/// Name under which the index is kept as it was found, where lines of it had to go.
pub(super) const INDEX_AS_FOUND: &str = "frames.interrupted.jsonl";

/// A session folder under way. The manifest says "recording" until [`Self::finish`] or
/// [`Self::abort`]; a writer that is dropped leaves it so, which is what the next start of a
/// capture looks for. While it lives, the folder is claimed: see [`Claim`].
#[derive(Debug)]
pub struct SessionWriter {
    folder: PathBuf,
    manifest: Manifest,
    index: FrameIndex,
    lines: File,
    /// Bytes of the index file's whole lines.
    length: u64,
    /// True where the index in memory says more than its file, or less.
    rewrite: bool,
    /// True where lines of the file have to go.
    truncated: bool,
    claim: Claim,
}

impl SessionWriter {
    /// Makes the folder `root/<id>` with a manifest whose status is "recording". The manifest's
    /// own status and the video's figures are not looked at: they are known at the end.
    ///
    /// # Errors
    /// [`Error::Exists`], [`Error::BadName`], a manifest that could not be read back, or what the
    /// file system answers.
    pub fn create(root: &Path, mut manifest: Manifest) -> Result<Self, Error> {
        if !is_session_name(&manifest.id) {
            return Err(Error::BadName(manifest.id));
        }
        let folder = root.join(&manifest.id);
        match fs::create_dir(&folder) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {
                return Err(Error::Exists(folder));
            }
            made => made.map_err(Error::io(&folder, "made"))?,
        }
        durable::sync_folder(root).map_err(Error::io(root, "synced"))?;
        // Claimed before there is a manifest: never does it stand there as if interrupted.
        let mut claim = Claim::take(&folder)?;
        claim.reserve()?;
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
            .map_err(Error::io(path, "made"))?;
        durable::sync_folder(&folder).map_err(Error::io(&folder, "synced"))?;
        Ok(Self {
            folder,
            manifest,
            index: FrameIndex::default(),
            lines,
            length: 0,
            rewrite: false,
            truncated: false,
            claim,
        })
    }

    /// The session folder.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Where the video belongs.
    #[must_use]
    pub fn video_path(&self) -> PathBuf {
        self.folder.join(&self.manifest.video.file)
    }

    /// The manifest, to note faults and what became known after the start.
    pub fn manifest_mut(&mut self) -> &mut Manifest {
        &mut self.manifest
    }

    /// Appends a frame's line to the index.
    ///
    /// # Errors
    /// [`Error::BadEntry`] where it does not continue the index, or what the file system answers.
    /// The index stays as it was, and the same entry may be pushed again.
    pub fn push(&mut self, entry: FrameEntry) -> Result<(), Error> {
        self.keep(entry)?;
        let written = self.append(&entry);
        if written.is_err() {
            self.take_back();
        }
        written.map_err(Error::io(self.folder.join(INDEX_FILE), "written"))
    }

    fn keep(&mut self, entry: FrameEntry) -> Result<(), Error> {
        self.index.push(entry).map_err(|fault| Error::BadEntry {
            path: self.folder.join(INDEX_FILE),
            n: entry.n,
            fault,
        })
    }

    /// Writes an entry's line behind the last whole one.
    fn append(&mut self, entry: &FrameEntry) -> io::Result<()> {
        let mut line = serde_json::to_vec(entry).map_err(io::Error::other)?;
        line.push(b'\n');
        self.cut()?;
        self.lines.write_all(&line)?;
        self.length += line.len() as u64;
        Ok(())
    }

    /// Cuts off what a line that could not be written whole left in the file.
    fn cut(&self) -> io::Result<()> {
        self.lines.set_len(self.length)
    }

    /// Forgets the last entry, whose line could not be written.
    fn take_back(&mut self) {
        // Where the file cannot be cut now, it is cut before the next line and before a sync.
        let _ = self.cut();
        self.index
            .truncate(self.index.entries().len().saturating_sub(1));
    }

    /// The index so far.
    #[must_use]
    pub fn index(&self) -> &FrameIndex {
        &self.index
    }

    /// Gives each frame what became known of it since its line was written, such as its angle. The
    /// file is rewritten, whole or not at all, when the session ends.
    ///
    /// # Errors
    /// [`Error::BadEntry`] for the first entry that does not fit; none is changed then.
    pub fn amend(&mut self, amended: impl Fn(&FrameEntry) -> FrameEntry) -> Result<(), Error> {
        let mut index = FrameIndex::default();
        for entry in self.index.entries() {
            let entry = amended(entry);
            index.push(entry).map_err(|fault| Error::BadEntry {
                path: self.folder.join(INDEX_FILE),
                n: entry.n,
                fault,
            })?;
        }
        self.rewrite |= index != self.index;
        self.index = index;
        Ok(())
    }

    /// Forgets all frames from position `frames` on, as the video lacks them. The index as it was
    /// stays beside the one that is written when the session ends, `frames.interrupted.jsonl`.
    pub fn truncate(&mut self, frames: usize) {
        if frames < self.index.entries().len() {
            self.index.truncate(frames);
            self.truncated = true;
        }
    }

    /// Makes the index durable up to the last frame pushed.
    ///
    /// # Errors
    /// What the file system answers.
    pub fn sync(&self) -> Result<(), Error> {
        self.cut()
            .and_then(|()| self.lines.sync_data())
            .map_err(Error::io(self.folder.join(INDEX_FILE), "synced"))
    }

    /// Ends a whole session: takes the video's size, hash and number of frames into the manifest
    /// and marks it complete. The video must have been closed.
    ///
    /// # Errors
    /// [`Error::VideoMissing`], or what the file system answers; the status stays "recording".
    pub fn finish(self) -> Result<Manifest, Error> {
        self.end(Status::Complete)
    }

    /// Ends a session that is not whole, for this reason. What was recorded stays.
    ///
    /// # Errors
    /// As [`Self::finish`].
    pub fn abort(self, reason: &str) -> Result<Manifest, Error> {
        self.end(Status::Aborted(reason.to_owned()))
    }

    fn end(self, status: Status) -> Result<Manifest, Error> {
        // On a full disk this is the room for what follows.
        self.claim.release_reserve()?;
        self.sync()?;
        if self.truncated {
            keep_as_found(&self.folder)?;
        }
        if self.rewrite || self.truncated {
            write_index(&self.folder, &self.index)?;
        }
        let frames = self.index.entries().len() as u64;
        let manifest = close(&self.folder, self.manifest, frames, status)?;
        self.claim.end()?;
        Ok(manifest)
    }
}

/// Gives the index as it is a second name, unless an earlier try did.
pub(super) fn keep_as_found(folder: &Path) -> Result<(), Error> {
    let (path, kept) = (folder.join(INDEX_FILE), folder.join(INDEX_AS_FOUND));
    if kept.exists() || !path.exists() {
        return Ok(());
    }
    // Not every file system has links.
    let linked = fs::hard_link(&path, &kept).or_else(|_| fs::copy(&path, &kept).map(|_| ()));
    linked.map_err(Error::io(kept, "written"))
}

/// Takes the video's size and hash into the manifest and writes it with its last status.
pub(super) fn close(
    folder: &Path,
    mut manifest: Manifest,
    frames: u64,
    status: Status,
) -> Result<Manifest, Error> {
    let path = folder.join(&manifest.video.file);
    // A capture can fail before its first frame: it is aborted without a video.
    if path.is_file() {
        let file = File::open(&path).map_err(Error::io(&path, "read"))?;
        file.sync_all().map_err(Error::io(&path, "synced"))?;
        let mut hasher = blake3::Hasher::new();
        let hashed = hasher
            .update_reader(file)
            .map_err(Error::io(&path, "read"))?;
        manifest.video.bytes = Some(hashed.count());
        manifest.video.blake3 = Some(hashed.finalize().to_hex().to_string());
    } else if status == Status::Complete {
        return Err(Error::VideoMissing(path));
    }
    manifest.status = status;
    manifest.video.frames = Some(frames);
    write_manifest(folder, &manifest)?;
    Ok(manifest)
}

pub(super) fn write_index(folder: &Path, index: &FrameIndex) -> Result<(), Error> {
    let path = folder.join(INDEX_FILE);
    let bytes = index.to_jsonl().map_err(io::Error::other);
    bytes
        .and_then(|bytes| durable::write_whole(&path, &bytes))
        .map_err(Error::io(&path, "written"))
}

fn write_manifest(folder: &Path, manifest: &Manifest) -> Result<(), Error> {
    let path = folder.join(MANIFEST_FILE);
    let bytes = manifest.to_json().map_err(|fault| Error::Manifest {
        path: path.clone(),
        fault,
    })?;
    durable::write_whole(&path, &bytes).map_err(Error::io(path, "written"))
}

#[cfg(test)]
pub(super) mod tests {
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
    fn a_line_that_was_not_written_whole_is_taken_back_and_can_be_pushed_again() {
        let root = tempfile::tempdir().unwrap();
        let mut writer = writer(root.path());
        writer.push(entry(0)).unwrap();
        let path = writer.folder().join(INDEX_FILE);
        let whole = std::mem::replace(&mut writer.lines, File::open(&path).unwrap());
        assert!(matches!(writer.push(entry(1)), Err(Error::Io { .. })));
        writer.lines = whole;
        writer.lines.write_all(b"{\"n\":1,\"seq").unwrap();
        writer.push(entry(1)).unwrap();
        writer.lines.write_all(b"{\"n\":2,").unwrap();
        writer.sync().unwrap();
        let index = FrameIndex::parse(&fs::read(path).unwrap()).unwrap();
        assert!(!index.is_torn());
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
        assert!(matches!(writer.amend(wrong), Err(Error::BadEntry { .. })));
        writer.amend(with_angle).unwrap();
        writer.finish().unwrap();
        let index = FrameIndex::parse(&fs::read(path).unwrap()).unwrap();
        assert_eq!(
            index.entries(),
            [entry(0), entry(1)].map(|e| with_angle(&e))
        );
    }
}
