//! Writing a session folder while it is recorded.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::{
    Error, FrameEntry, FrameIndex, INDEX_FILE, MANIFEST_FILE, Manifest, Status, is_session_name,
};
use crate::durable;

/// A session folder under way. The manifest says "recording" until [`Self::finish`] or
/// [`Self::abort`]; a writer that is dropped leaves it so, which is what the next start of a
/// capture looks for.
#[derive(Debug)]
pub struct SessionWriter {
    folder: PathBuf,
    manifest: Manifest,
    index: FrameIndex,
    lines: File,
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
        Ok(Self {
            folder,
            manifest,
            index: FrameIndex::default(),
            lines,
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
    pub fn push(&mut self, entry: FrameEntry) -> Result<(), Error> {
        let path = || self.folder.join(INDEX_FILE);
        self.index.push(entry).map_err(|fault| Error::BadEntry {
            path: path(),
            n: entry.n,
            fault,
        })?;
        let mut line = serde_json::to_vec(&entry)
            .map_err(io::Error::other)
            .map_err(Error::io(path(), "written"))?;
        line.push(b'\n');
        self.lines
            .write_all(&line)
            .map_err(Error::io(path(), "written"))
    }

    /// Makes the index durable up to the last frame pushed.
    ///
    /// # Errors
    /// What the file system answers.
    pub fn sync(&self) -> Result<(), Error> {
        self.lines
            .sync_data()
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

    fn end(mut self, status: Status) -> Result<Manifest, Error> {
        self.sync()?;
        let path = self.video_path();
        // A capture can fail before its first frame: it is aborted without a video.
        if path.is_file() {
            let file = File::open(&path).map_err(Error::io(&path, "read"))?;
            file.sync_all().map_err(Error::io(&path, "synced"))?;
            let mut hasher = blake3::Hasher::new();
            let hashed = hasher
                .update_reader(file)
                .map_err(Error::io(&path, "read"))?;
            self.manifest.video.bytes = Some(hashed.count());
            self.manifest.video.blake3 = Some(hashed.finalize().to_hex().to_string());
        } else if status == Status::Complete {
            return Err(Error::VideoMissing(path));
        }
        self.manifest.status = status;
        self.manifest.video.frames = Some(self.index.entries().len() as u64);
        write_manifest(&self.folder, &self.manifest)?;
        Ok(self.manifest)
    }
}

fn write_manifest(folder: &Path, manifest: &Manifest) -> Result<(), Error> {
    let path = folder.join(MANIFEST_FILE);
    let bytes = manifest.to_json().map_err(|fault| Error::Manifest {
        path: path.clone(),
        fault,
    })?;
    durable::write_whole(&path, &bytes).map_err(Error::io(path, "written"))
}
