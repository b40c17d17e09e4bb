//! Writing so that a file appears whole or not at all, and one writer a folder.

use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::dataset::FileEntry;
use super::digest::HashingWriter;
use super::{Error, names};

/// The folder of a data set, held by this process alone until it is dropped.
#[derive(Debug)]
pub struct OutputFolder {
    path: PathBuf,
    /// The lock lives as long as this handle.
    _handle: File,
}

impl OutputFolder {
    /// Makes the folder where it does not exist, takes it for this process, and clears away what
    /// a killed writer left behind: files under temporary names. An image folder that was being
    /// replaced comes back under its name.
    ///
    /// # Errors
    /// [`Error::Locked`] where another process has it; [`Error::Io`] where it cannot be made,
    /// opened, locked or cleared.
    pub fn lock(out: &Path) -> Result<Self, Error> {
        fs::create_dir_all(out).map_err(Error::io("make the folder", out))?;
        let handle = File::open(out).map_err(Error::io("open the folder", out))?;
        handle.try_lock().map_err(|reason| match reason {
            TryLockError::WouldBlock => Error::Locked {
                path: out.to_owned(),
            },
            TryLockError::Error(source) => Error::Io {
                doing: "lock the folder",
                path: out.to_owned(),
                source,
            },
        })?;
        clear_leftovers(out)?;
        Ok(Self {
            path: out.to_owned(),
            _handle: handle,
        })
    }

    /// The folder.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a file directly in the folder, whole or not at all, and returns the entry that
    /// vouches for it. For the page of a session, for example.
    ///
    /// # Errors
    /// [`Error::UnsafePath`] where `name` is not a plain path; [`Error::Io`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<FileEntry, Error> {
        write_whole(&self.path, name, bytes)
    }
}

/// Writes `bytes` to `file`, a path relative to `out`, whole or not at all.
pub(super) fn write_whole(out: &Path, file: &str, bytes: &[u8]) -> Result<FileEntry, Error> {
    let mut partial = PartialFile::create(out, file)?;
    partial
        .write_all(bytes)
        .map_err(Error::io("write", &out.join(file)))?;
    partial.seal()?.publish()
}

/// A file that is being written under a temporary name. Dropped, it is removed.
pub(super) struct PartialFile {
    writer: HashingWriter<BufWriter<File>>,
    names: Names,
}

/// A file that is whole and on the disk, still under its temporary name. Dropped, it is removed.
pub(super) struct SealedFile {
    names: Names,
    entry: FileEntry,
}

/// Where a file is written and where it is to appear; removes the first when dropped.
struct Names {
    temporary: PathBuf,
    last: PathBuf,
    file: String,
}

impl Drop for Names {
    fn drop(&mut self) {
        // After publishing there is nothing under this name; an error has no one to go to.
        let _ = fs::remove_file(&self.temporary);
    }
}

impl PartialFile {
    /// Starts `file`, a path relative to `out`, under `.NAME.partial` in the same folder.
    pub(super) fn create(out: &Path, file: &str) -> Result<Self, Error> {
        names::check_path(file)?;
        let last = out.join(file);
        let name = file.rsplit('/').next().unwrap_or(file);
        let temporary = last.with_file_name(names::partial(name));
        let handle = File::create(&temporary).map_err(Error::io("create", &temporary))?;
        let writer = HashingWriter::new(BufWriter::with_capacity(1 << 18, handle));
        Ok(Self {
            writer,
            names: Names {
                temporary,
                last,
                file: file.to_owned(),
            },
        })
    }

    /// Brings all bytes to the disk.
    pub(super) fn seal(self) -> Result<SealedFile, Error> {
        let Self { writer, names } = self;
        let (buffered, bytes, blake3) = writer.finish();
        let written = buffered
            .into_inner()
            .map_err(io::IntoInnerError::into_error);
        written
            .and_then(|file| file.sync_all())
            .map_err(Error::io("write", &names.temporary))?;
        let entry = FileEntry {
            file: names.file.clone(),
            bytes,
            blake3,
        };
        Ok(SealedFile { names, entry })
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
    /// Gives the file its name, in place of an older one.
    pub(super) fn publish(self) -> Result<FileEntry, Error> {
        let Names {
            temporary, last, ..
        } = &self.names;
        fs::rename(temporary, last).map_err(Error::io("rename a finished file to", last))?;
        sync_folder_of(last)?;
        Ok(self.entry.clone())
    }
}

/// A file of which only the handle is wanted, created where there is none; removed when dropped.
pub(super) struct ScratchFile {
    pub(super) file: File,
    pub(super) path: PathBuf,
}

impl ScratchFile {
    pub(super) fn create(path: PathBuf) -> Result<Self, Error> {
        let options = OpenOptions::new()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&path);
        match options {
            Ok(file) => Ok(Self { file, path }),
            Err(e) if e.kind() == io::ErrorKind::AlreadyExists => Err(Error::Busy { path }),
            Err(source) => Err(Error::Io {
                doing: "create",
                path,
                source,
            }),
        }
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
    }
}

/// Makes a rename in the folder of `path` last.
pub(super) fn sync_folder_of(path: &Path) -> Result<(), Error> {
    let folder = path.parent().unwrap_or(Path::new("."));
    sync(folder)
}

/// Brings a file or folder to the disk.
pub(super) fn sync(path: &Path) -> Result<(), Error> {
    File::open(path)
        .and_then(|file| file.sync_all())
        .map_err(Error::io("write", path))
}

/// Removes a folder and all in it, if it is there.
pub(super) fn remove_folder(path: &Path) -> Result<(), Error> {
    match fs::remove_dir_all(path) {
        Err(e) if e.kind() != io::ErrorKind::NotFound => Err(Error::Io {
            doing: "remove",
            path: path.to_owned(),
            source: e,
        }),
        _ => Ok(()),
    }
}

/// The names in a folder, sorted; none where there is no such folder. A name that is not UTF-8
/// is none of ours, and is given with its odd bytes replaced.
pub(super) fn names_in(folder: &Path) -> Result<Vec<String>, Error> {
    let entries = match fs::read_dir(folder) {
        Ok(entries) => entries,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        Err(source) => {
            return Err(Error::Io {
                doing: "list",
                path: folder.to_owned(),
                source,
            });
        }
    };
    let mut names = entries
        .map(|entry| entry.map(|e| lossless_or_marked(&e.file_name())))
        .collect::<Result<Vec<_>, _>>()
        .map_err(Error::io("list", folder))?;
    names.sort_unstable();
    Ok(names)
}

fn lossless_or_marked(name: &OsStr) -> String {
    name.to_string_lossy().into_owned()
}

fn clear_leftovers(out: &Path) -> Result<(), Error> {
    for folder in [
        out.to_owned(),
        out.join(names::MASKS),
        out.join(names::MEANS),
    ] {
        for name in names_in(&folder)?
            .iter()
            .filter(|name| names::is_leftover(name))
        {
            let path = folder.join(name);
            if path.is_file() {
                fs::remove_file(&path).map_err(Error::io("remove", &path))?;
            }
        }
    }
    clear_image_leftovers(&out.join(names::IMAGES))
}

fn clear_image_leftovers(images: &Path) -> Result<(), Error> {
    let found = names_in(images)?;
    for name in &found {
        // The writer was killed between taking the old folder away and giving its name to the
        // new one: the old one, which dataset.json vouches for, comes back.
        if let Some(session) = names::session_of_outgoing(name) {
            let (aside, place) = (images.join(name), images.join(session));
            if place.exists() {
                remove_folder(&aside)?;
            } else {
                fs::rename(&aside, &place).map_err(Error::io("bring back", &place))?;
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
    fn a_file_that_is_not_published_leaves_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let mut partial = PartialFile::create(dir.path(), "a.tar").unwrap();
        partial.write_all(b"half").unwrap();
        assert_eq!(names_in(dir.path()).unwrap(), [".a.tar.partial"]);
        drop(partial.seal().unwrap());
        assert!(names_in(dir.path()).unwrap().is_empty());
    }

    #[test]
    fn a_second_writer_is_kept_out_until_the_first_is_done() {
        let dir = tempfile::tempdir().unwrap();
        let first = OutputFolder::lock(dir.path()).unwrap();
        assert!(matches!(
            OutputFolder::lock(dir.path()),
            Err(Error::Locked { .. })
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
            ".a.tar.partial",
            ".bashrc",
            "a.tar",
            "masks/.a.png.partial",
            "masks/a.png",
        ] {
            fs::write(at(file), b"x").unwrap();
        }
        fs::write(at("imgs/.b.outgoing/0.png"), b"x").unwrap();
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
    fn a_written_file_is_vouched_for_by_its_entry() {
        let dir = tempfile::tempdir().unwrap();
        let folder = OutputFolder::lock(dir.path()).unwrap();
        let entry = folder.write("a.html", b"page").unwrap();
        assert_eq!((entry.file.as_str(), entry.bytes), ("a.html", 4));
        assert!(matches!(
            folder.write("../a.html", b""),
            Err(Error::UnsafePath { .. })
        ));
    }
}
