//! Files that appear whole or not at all. Knows nothing of their content.

use std::ffi::OsString;
use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bytes that are buffered before they are written.
const BUFFER: usize = 1 << 18;

/// A file that is being written under a temporary name, `.NAME.<process>.<counter>.partial`, in the
/// folder of its final name. No two writers share a temporary name, and an existing file or link is
/// never reused. Dropping it removes the file.
#[derive(Debug)]
pub struct Partial {
    writer: BufWriter<File>,
    names: Names,
}

/// A file that is complete and synced to disk, still under its temporary name. Dropping it removes
/// the file.
#[derive(Debug)]
pub struct SealedPartial {
    names: Names,
}

/// A file's temporary and final path; removes the temporary file when dropped.
#[derive(Debug)]
struct Names {
    temporary: PathBuf,
    target: PathBuf,
}

impl Drop for Names {
    fn drop(&mut self) {
        // After publishing there is nothing under this name, and an error cannot be returned here.
        let _ = fs::remove_file(&self.temporary);
    }
}

impl Partial {
    /// Starts the file that will appear at `path`.
    ///
    /// # Errors
    /// If `path` has no file name, or the file cannot be created.
    pub fn create(path: &Path) -> io::Result<Self> {
        loop {
            let temporary = temporary_name(path)?;
            let opened = OpenOptions::new()
                .write(true)
                .create_new(true)
                .open(&temporary);
            match opened {
                // Left behind by a killed process that had the same id.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
                Ok(file) => {
                    return Ok(Self {
                        writer: BufWriter::with_capacity(BUFFER, file),
                        names: Names {
                            temporary,
                            target: path.to_owned(),
                        },
                    });
                }
            }
        }
    }

    /// Where it is until then, for a program that writes it.
    pub fn path(&self) -> &Path {
        &self.names.temporary
    }

    /// The final path.
    pub fn target(&self) -> &Path {
        &self.names.target
    }

    /// Writes and syncs all bytes to disk.
    ///
    /// # Errors
    /// If writing or syncing fails; the file is then removed.
    pub fn seal(self) -> io::Result<SealedPartial> {
        let Self { writer, names } = self;
        let file = writer
            .into_inner()
            .map_err(io::IntoInnerError::into_error)?;
        file.sync_all()?;
        Ok(SealedPartial { names })
    }
}

impl Write for Partial {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        self.writer.write(buffer)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }
}

impl SealedPartial {
    /// All bytes of the file that will appear at `path`, synced to disk.
    ///
    /// # Errors
    /// If any step fails; the temporary file is then removed.
    pub fn write(path: &Path, bytes: &[u8]) -> io::Result<Self> {
        let mut partial = Partial::create(path)?;
        partial.write_all(bytes)?;
        partial.seal()
    }

    /// The final path.
    pub fn target(&self) -> &Path {
        &self.names.target
    }

    /// Renames the file to its final name, replacing an older one.
    ///
    /// # Errors
    /// If renaming or syncing the folder fails; a file that has not been renamed is removed.
    pub fn publish(self) -> io::Result<()> {
        publish(&self.names.temporary, &self.names.target)
    }
}

/// Writes `bytes` so that `path` holds either its old content or all of the new content, even after
/// a power cut. If several write at once, the last one wins.
///
/// # Errors
/// If any step fails; the temporary file is then removed.
pub fn write_whole(path: &Path, bytes: &[u8]) -> io::Result<()> {
    SealedPartial::write(path, bytes)?.publish()
}

/// A folder that was there, or that was made with those around it. What was made and is empty when this is dropped is
/// removed again: what fails before its first file leaves nothing behind.
#[derive(Debug)]
#[must_use = "what was made is removed with it while it is empty"]
pub struct CreatedFolder {
    /// Those that were made, the outermost first.
    made: Vec<PathBuf>,
}

impl CreatedFolder {
    /// Makes the folder, and those around it, where they are missing.
    ///
    /// # Errors
    /// If one of them cannot be made.
    pub fn make(path: &Path) -> io::Result<Self> {
        let is_missing = |folder: &&Path| !folder.as_os_str().is_empty() && !folder.exists();
        let missing = path.ancestors().take_while(is_missing);
        let mut made: Vec<PathBuf> = missing.map(Path::to_owned).collect();
        made.reverse();
        let made = Self { made };
        fs::create_dir_all(path)?;
        Ok(made)
    }
}

impl Drop for CreatedFolder {
    fn drop(&mut self) {
        for folder in self.made.iter().rev() {
            // One that holds something stays, and so do those around it.
            if fs::remove_dir(folder).is_err() {
                return;
            }
        }
    }
}

/// Renames a finished, synced file or folder to its final name and syncs the rename to disk.
///
/// # Errors
/// If renaming or syncing the folder fails.
pub fn publish(partial: &Path, path: &Path) -> io::Result<()> {
    fs::rename(partial, path)?;
    sync_folder(path.parent().unwrap_or(Path::new("")))
}

/// Syncs the names in `folder` to disk. The empty path is the current folder.
///
/// # Errors
/// If the folder cannot be opened or synced.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    let here = folder.as_os_str().is_empty();
    File::open(if here { Path::new(".") } else { folder })?.sync_all()
}

/// The final name of the file, if `name` is the temporary name of a [`Partial`].
pub fn target_of(name: &str) -> Option<&str> {
    let (rest, counter) = name
        .strip_prefix('.')?
        .strip_suffix(".partial")?
        .rsplit_once('.')?;
    let (target, process) = rest.rsplit_once('.')?;
    let is_number = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    (is_number(counter) && is_number(process) && !target.is_empty()).then_some(target)
}

/// A name for `path` that this process has not used before.
fn temporary_name(path: &Path) -> io::Result<PathBuf> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let target = path
        .file_name()
        .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path has no file name"))?;
    let mut name = OsString::from(".");
    name.push(target);
    let counter = COUNTER.fetch_add(1, Ordering::Relaxed);
    name.push(format!(".{}.{counter}.partial", process::id()));
    Ok(path.with_file_name(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_was_made_and_stays_empty_is_removed_with_those_around_it() {
        let root = tempfile::tempdir().unwrap();
        let (outer, inner) = (root.path().join("a"), root.path().join("a/b"));
        drop(CreatedFolder::make(&inner).unwrap());
        assert!(!outer.exists() && root.path().exists());
        fs::create_dir(&outer).unwrap();
        drop(CreatedFolder::make(&inner).unwrap());
        assert!(outer.exists() && !inner.exists(), "it was there before");
        let made = CreatedFolder::make(&inner).unwrap();
        fs::write(inner.join("file"), "").unwrap();
        drop(made);
        assert!(inner.join("file").exists());
    }
    use std::thread;

    fn names_in(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect()
    }

    #[test]
    fn a_file_is_replaced_whole_and_leaves_no_temporary_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        write_whole(&path, b"one").unwrap();
        write_whole(&path, b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
        assert_eq!(names_in(folder.path()), ["a.json"]);
    }

    #[test]
    fn a_failed_write_keeps_the_old_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        fs::create_dir_all(path.join("inner")).unwrap();
        assert!(write_whole(&path, b"x").is_err());
        assert!(path.join("inner").is_dir());
        assert_eq!(names_in(folder.path()), ["taken"]);
    }

    #[test]
    fn a_file_that_is_not_published_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let mut partial = Partial::create(&folder.path().join("a.tar")).unwrap();
        partial.write_all(b"half").unwrap();
        let names = names_in(folder.path());
        assert_eq!(target_of(&names[0]), Some("a.tar"), "{names:?}");
        drop(partial.seal().unwrap());
        assert!(names_in(folder.path()).is_empty());
    }

    #[test]
    fn writers_of_one_file_at_once_never_publish_a_torn_one() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.json");
        thread::scope(|scope| {
            for value in 0..8 {
                let path = &path;
                scope.spawn(move || {
                    for _ in 0..20 {
                        write_whole(path, &[value; 5000]).unwrap();
                        let read = fs::read(path).unwrap();
                        assert_eq!(read, [read[0]; 5000]);
                    }
                });
            }
        });
        assert_eq!(names_in(folder.path()), ["a.json"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_under_temporary_names_are_neither_followed_nor_in_the_way() {
        let folder = tempfile::tempdir().unwrap();
        let (path, outside) = (folder.path().join("a"), folder.path().join("outside"));
        // The counter is shared by the process: other tests may use some of these numbers.
        let next = temporary_name(&path).unwrap();
        let number = |name: &Path| -> u64 {
            let name = name.file_name().unwrap().to_str().unwrap();
            name.split('.').nth_back(1).unwrap().parse().unwrap()
        };
        for counter in 1..100 {
            let name = format!(".a.{}.{}.partial", process::id(), number(&next) + counter);
            std::os::unix::fs::symlink(&outside, folder.path().join(name)).unwrap();
        }
        write_whole(&path, b"x").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"x");
        assert!(!outside.exists());
    }

    #[test]
    fn a_path_without_a_file_name_is_refused() {
        let error = write_whole(Path::new("/"), b"x").unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidInput);
    }

    #[test]
    fn the_empty_path_is_the_current_folder() {
        sync_folder(Path::new("")).unwrap();
        assert!(sync_folder(Path::new("no such folder")).is_err());
    }

    #[test]
    fn the_final_name_is_read_from_a_temporary_one() {
        assert_eq!(target_of(".a.tar.12.0.partial"), Some("a.tar"));
        for name in [
            ".a.tar.partial",
            "a.tar.1.2.partial",
            ".a.tar.1.x.partial",
            ".a.tar.1..partial",
            ".a.tar.1.2.parti",
            "..1.2.partial",
        ] {
            assert_eq!(target_of(name), None, "{name}");
        }
    }
}
