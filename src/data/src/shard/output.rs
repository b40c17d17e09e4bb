//! The folder of a data set: one writer at a time, and files that appear whole and hashed.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::digest::Hashing;
use super::file::FileEntry;
use super::partial_manifest::ArrayTask;
use super::{ShardError, names};
use crate::durable::{self, CreatedFolder, Partial, SealedPartial};

/// The folder of a data set, locked by this process until it is dropped.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    /// The locks are held as long as these handles.
    _handle: File,
    _task: Option<File>,
    /// A run that fails before its first file leaves no folder behind.
    _made: Option<CreatedFolder>,
}

impl OutputFolder {
    /// Creates the folder if it does not exist, locks it, and removes the temporary files that a
    /// killed writer left behind. An image folder that was being replaced gets its name back.
    ///
    /// # Errors
    /// [`ShardError::Locked`] if another process holds the lock; [`ShardError::Io`] if the folder cannot be
    /// created, opened, locked or cleaned.
    pub fn lock(out: &Path) -> Result<Self, ShardError> {
        let made = CreatedFolder::make(out).map_err(ShardError::io("make the folder", out))?;
        Ok(Self {
            _made: Some(made),
            ..Self::lock_existing(out)?
        })
    }

    /// As [`lock`](Self::lock), of a folder that exists.
    pub(super) fn lock_existing(out: &Path) -> Result<Self, ShardError> {
        let handle = File::open(out).map_err(ShardError::io("open the folder", out))?;
        locked(handle.try_lock(), out)?;
        clear_leftovers(out)?;
        Ok(Self {
            path: out.to_owned(),
            _handle: handle,
            _task: None,
            _made: None,
        })
    }

    /// Locks the folder for one of several tasks, which is created if it does not exist. Other tasks may
    /// write into it at the same time; a run of all recordings, a merge, and the same task may not.
    /// Temporary files stay: see [`clear_leftovers_of`](Self::clear_leftovers_of).
    ///
    /// # Errors
    /// As [`lock`](Self::lock).
    pub fn lock_for(out: &Path, task: ArrayTask) -> Result<Self, ShardError> {
        let tasks = out.join(names::TASKS);
        fs::create_dir_all(&tasks).map_err(ShardError::io("make the folder", &tasks))?;
        let handle = File::open(out).map_err(ShardError::io("open the folder", out))?;
        locked(handle.try_lock_shared(), out)?;
        let path = tasks.join(format!(".{task}.lock"));
        let own = File::create(&path).map_err(ShardError::io("create", &path))?;
        locked(own.try_lock(), &path)?;
        let file = task.file();
        let own_name = file.rsplit('/').next().unwrap_or_default();
        for name in names_in(&tasks)? {
            if durable::target_of(&name) == Some(own_name) {
                remove_leftover(&tasks.join(name))?;
            }
        }
        Ok(Self {
            path: out.to_owned(),
            _handle: handle,
            _task: Some(own),
            _made: None,
        })
    }

    /// Removes what an interrupted writer of `session` left behind; an image folder that was being replaced
    /// gets its name back.
    ///
    /// # Errors
    /// [`ShardError::Io`] if the folder cannot be cleaned.
    pub fn clear_leftovers_of(&self, session: &str) -> Result<(), ShardError> {
        clear_files(&self.path, |name| names::is_leftover_of(session, name))?;
        clear_image_leftovers(&self.path.join(names::IMAGES), |name| {
            name == names::partial(session) || name == names::outgoing(session)
        })
    }

    /// The folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a file into the folder, whole or not at all, and returns its entry for `dataset.json`:
    /// the page of a session, for example.
    ///
    /// # Errors
    /// [`ShardError::Refused`] if `name` is not a relative path inside the folder; [`ShardError::Io`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<FileEntry, ShardError> {
        write_whole(&self.path, name, bytes)
    }
}

/// Keeps writers out of the data set in a folder while the handle is open; several may read.
///
/// # Errors
/// [`ShardError::Locked`] if it is being written; [`ShardError::NoDataset`] if the folder does not exist.
pub(super) fn lock_for_reading(out: &Path) -> Result<File, ShardError> {
    let handle = File::open(out).map_err(|_| ShardError::NoDataset(out.to_owned()))?;
    locked(handle.try_lock_shared(), out)?;
    Ok(handle)
}

fn locked(result: Result<(), TryLockError>, path: &Path) -> Result<(), ShardError> {
    result.map_err(|reason| match reason {
        TryLockError::WouldBlock => ShardError::Locked(path.to_owned()),
        TryLockError::Error(source) => ShardError::io("lock", path)(source),
    })
}

/// Writes `bytes` to `file`, a path relative to `out`, whole or not at all.
pub(super) fn write_whole(out: &Path, file: &str, bytes: &[u8]) -> Result<FileEntry, ShardError> {
    let needs = |error: ShardError| error.with_needs(file, out, bytes.len() as u64, 0);
    seal_whole(out, file, bytes)
        .and_then(SealedFile::publish)
        .map_err(needs)
}

/// As [`write_whole`], without the final rename.
pub(super) fn seal_whole(out: &Path, file: &str, bytes: &[u8]) -> Result<SealedFile, ShardError> {
    let mut partial = PartialFile::create(out, file)?;
    partial
        .write_all(bytes)
        .map_err(ShardError::io("write", &out.join(file)))?;
    partial.seal()
}

/// A file of the data set that is being written and hashed. Dropping it removes the file.
pub(super) struct PartialFile {
    writer: Hashing<Partial>,
    file: String,
}

/// A file that is complete and synced to disk, still under its temporary name. Dropping it removes
/// the file.
pub(super) struct SealedFile {
    sealed: SealedPartial,
    entry: FileEntry,
}

impl PartialFile {
    /// Starts `file`, a path relative to `out`.
    pub(super) fn create(out: &Path, file: &str) -> Result<Self, ShardError> {
        names::check_path(file)?;
        let path = out.join(file);
        let partial = Partial::create(&path).map_err(ShardError::io("create", &path))?;
        Ok(Self {
            writer: Hashing::new(partial),
            file: file.to_owned(),
        })
    }

    /// Writes and syncs all bytes to disk.
    pub(super) fn seal(self) -> Result<SealedFile, ShardError> {
        let (bytes, blake3) = self.writer.digest();
        let partial = self.writer.into_inner();
        let path = partial.target().to_owned();
        let sealed = partial.seal().map_err(ShardError::io("write", &path))?;
        let file = self.file;
        Ok(SealedFile {
            sealed,
            entry: FileEntry {
                file,
                bytes,
                blake3,
            },
        })
    }
}

impl Write for PartialFile {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.writer.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl SealedFile {
    /// Renames the file to its final name, replacing an older one.
    pub(super) fn publish(self) -> Result<FileEntry, ShardError> {
        let path = self.sealed.target().to_owned();
        let published = self.sealed.publish();
        published.map_err(ShardError::io("rename a finished file to", &path))?;
        Ok(self.entry)
    }
}

/// A temporary file for reading and writing; removed when dropped.
pub(super) struct ScratchFile {
    pub(super) file: File,
    pub(super) path: PathBuf,
}

impl ScratchFile {
    pub(super) fn create(path: PathBuf) -> Result<Self, ShardError> {
        let opened = OpenOptions::new()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&path);
        match opened {
            Ok(file) => Ok(Self { file, path }),
            Err(error) => Err(busy("create", &path)(error)),
        }
    }
}

/// For `map_err`: another writer has what this one wants to create, or it cannot be created.
pub(super) fn busy(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> ShardError {
    move |error| match error.kind() {
        io::ErrorKind::AlreadyExists => ShardError::Busy(path.to_owned()),
        _ => ShardError::io(doing, path)(error),
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Syncs a file or folder to disk.
pub(super) fn sync(path: &Path) -> Result<(), ShardError> {
    File::open(path)
        .and_then(|file| file.sync_all())
        .map_err(ShardError::io("write", path))
}

/// Syncs a folder and the files in it to disk.
pub(super) fn sync_content(folder: &Path) -> Result<(), ShardError> {
    if sync_file_system(folder) {
        return Ok(());
    }
    for name in names_in(folder)? {
        sync(&folder.join(name))?;
    }
    sync(folder)
}

/// Syncs the whole file system of `path` at once: 1500 files of 40 kB took 0.1 s, and 7 s one by one. False where that cannot be done, or something could not be written: then
/// syncing each file says which.
#[cfg(target_os = "linux")]
fn sync_file_system(path: &Path) -> bool {
    File::open(path).is_ok_and(|folder| rustix::fs::syncfs(&folder).is_ok())
}

#[cfg(not(target_os = "linux"))]
fn sync_file_system(_: &Path) -> bool {
    false
}

/// Removes a folder and its content, if it exists.
pub(super) fn remove_folder(path: &Path) -> Result<(), ShardError> {
    match fs::remove_dir_all(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(ShardError::io("remove", path)(e)),
        _ => Ok(()),
    }
}

/// The names in a folder, sorted; none if the folder does not exist. In a name that is not UTF-8,
/// invalid bytes are replaced: the writer uses no such names.
pub(super) fn names_in(folder: &Path) -> Result<Vec<String>, ShardError> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(error) => return Err(ShardError::io("list", folder)(error)),
    };
    let mut names = entries
        .map(|entry| entry.map(|e| e.file_name().to_string_lossy().into_owned()))
        .collect::<Result<Vec<_>, _>>()
        .map_err(ShardError::io("list", folder))?;
    names.sort_unstable();
    Ok(names)
}

fn clear_leftovers(out: &Path) -> Result<(), ShardError> {
    clear_files(out, names::is_leftover)?;
    clear_image_leftovers(&out.join(names::IMAGES), |_| true)
}

fn clear_files(out: &Path, is_leftover: impl Fn(&str) -> bool) -> Result<(), ShardError> {
    for folder in ["", names::MASKS, names::MEANS, names::TASKS] {
        let folder = out.join(folder);
        for name in names_in(&folder)?.iter().filter(|name| is_leftover(name)) {
            remove_leftover(&folder.join(name))?;
        }
    }
    Ok(())
}

/// Removes a file or a link (not its target), and leaves folders alone.
fn remove_leftover(path: &Path) -> Result<(), ShardError> {
    let found = fs::symlink_metadata(path).map_err(ShardError::io("look at", path))?;
    if found.is_dir() {
        return Ok(());
    }
    fs::remove_file(path).map_err(ShardError::io("remove", path))
}

fn clear_image_leftovers(images: &Path, wanted: impl Fn(&str) -> bool) -> Result<(), ShardError> {
    let mut found = names_in(images)?;
    found.retain(|name| wanted(name));
    for name in &found {
        // The writer was killed between moving the old folder away and renaming the new one: the old
        // one, which dataset.json still describes, gets its name back.
        if let Some(session) = names::session_of_outgoing(name) {
            let (old, path) = (images.join(name), images.join(session));
            if path.exists() {
                remove_folder(&old)?;
            } else {
                fs::rename(&old, &path).map_err(ShardError::io("restore", &path))?;
            }
        }
    }
    for name in &found {
        if name.starts_with('.') && name.ends_with(".partial") {
            remove_folder(&images.join(name))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_writer_is_kept_out_until_the_first_is_done() {
        let dir = tempfile::tempdir().unwrap();
        let first = OutputFolder::lock(dir.path()).unwrap();
        assert!(matches!(
            OutputFolder::lock(dir.path()),
            Err(ShardError::Locked { .. })
        ));
        drop(first);
        assert!(OutputFolder::lock(dir.path()).is_ok());
    }

    #[test]
    fn leftovers_of_a_killed_writer_are_cleared_and_nothing_else() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        for folder in [
            "imgs/.a.partial",
            "imgs/.b.outgoing",
            "imgs/.c.outgoing",
            "imgs/c",
            "masks",
        ] {
            fs::create_dir_all(at(folder)).unwrap();
        }
        for file in [
            ".a.spool",
            ".a.tar.7.0.partial",
            ".bashrc",
            "a.tar",
            "masks/.a.png.7.1.partial",
            "masks/a.png",
        ] {
            fs::write(at(file), b"x").unwrap();
        }
        fs::write(at("imgs/.b.outgoing/0.png"), b"x").unwrap();
        #[cfg(unix)]
        std::os::unix::fs::symlink("nowhere", at(".b.tar.7.2.partial")).unwrap();
        OutputFolder::lock(dir.path()).unwrap();
        assert_eq!(
            names_in(dir.path()).unwrap(),
            [".bashrc", "a.tar", "imgs", "masks"]
        );
        assert_eq!(names_in(&at("imgs")).unwrap(), ["b", "c"]);
        assert_eq!(names_in(&at("masks")).unwrap(), ["a.png"]);
        assert!(at("imgs/b/0.png").exists());
    }

    #[test]
    fn a_written_file_gets_an_entry_with_its_length() {
        let dir = tempfile::tempdir().unwrap();
        let folder = OutputFolder::lock(dir.path()).unwrap();
        let entry = folder.write("a.html", b"page").unwrap();
        assert_eq!((entry.file.as_str(), entry.bytes), ("a.html", 4));
        assert!(matches!(
            folder.write("../a.html", b""),
            Err(ShardError::Refused(_))
        ));
    }
}
