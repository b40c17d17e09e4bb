//! A folder of results in the place of an earlier one: whole or not at all, and without the loss of anything else. Knows
//! nothing of what the files hold.
//!
//! The new folder is made under a hidden name beside the other, and the two are exchanged in one step where the
//! system can. Where it cannot, the earlier folder has the name `.<name>.earlier` for a moment; a run that was killed then has
//! left it there, and the next run puts it back.

use std::fs;
use std::io;
use std::path::{Path, PathBuf, absolute};
use std::process;

use relit_data::durable::{Partial, publish, sync_folder};

/// Why a folder is not written.
#[derive(Debug, thiserror::Error)]
pub enum FolderFault {
    /// It holds something else: its name.
    #[error(
        "{path} holds {1}, which no earlier run wrote: give a folder that is new, empty, or holds only earlier results",
        path = .0.display()
    )]
    Foreign(PathBuf, String),
    /// The path exists and is not a folder.
    #[error("{} cannot be the folder for the results: give the name of a folder, not of a file", .0.display())]
    NoFolder(PathBuf),
    /// It cannot be read.
    #[error("{path} cannot be read: {1}", path = .0.display())]
    Read(PathBuf, io::Error),
    /// It, or what it lies in, cannot be written.
    #[error("{path} cannot be written: {1}", path = .0.display())]
    Write(PathBuf, io::Error),
}

impl FolderFault {
    fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Read(path, source)
    }

    fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write(path, source)
    }
}

/// What a folder of results holds.
#[derive(Debug, Clone, Copy)]
pub struct ResultFolder {
    /// The file without which it is none.
    pub marker: &'static str,
    /// Whether a file or folder of this name is one of its results.
    pub holds: fn(&str) -> bool,
}

impl ResultFolder {
    /// Whether results may be written to the folder `out`: it is missing, empty, or holds only earlier results, and
    /// its parent can be written.
    ///
    /// # Errors
    /// [`FolderFault::Foreign`] or [`FolderFault::NoFolder`], or if a folder cannot be read or written.
    pub fn check(self, out: &Path) -> Result<(), FolderFault> {
        let no_folder = |path: &Path| FolderFault::NoFolder(path.to_owned());
        out.file_name().ok_or_else(|| no_folder(out))?;
        let exists = |path: &Path| fs::symlink_metadata(path).is_ok();
        if let Some(nearest) = out.ancestors().find(|path| exists(path))
            && !nearest.is_dir()
        {
            return Err(no_folder(nearest));
        }
        let out = &resolved(out);
        let whole = absolute(out).map_err(FolderFault::write(out))?;
        if let Some(parent) = whole.ancestors().skip(1).find(|path| path.is_dir()) {
            // Such a file is gone when it is dropped.
            let trial = Partial::create(&parent.join("results"));
            trial.map(drop).map_err(FolderFault::write(out))?;
        }
        let earlier = hidden_beside(out, "earlier");
        for folder in [out, &earlier] {
            if exists(folder) {
                self.check_names(folder)?;
            }
        }
        Ok(())
    }

    /// Whether a folder is empty or holds only results.
    fn check_names(self, folder: &Path) -> Result<(), FolderFault> {
        let names = names_in(folder).map_err(FolderFault::read(folder))?;
        // Without the marker, files of these names can be anything's.
        let has_marker = names.iter().any(|name| name == self.marker);
        match names
            .into_iter()
            .find(|name| !(has_marker && (self.holds)(name)))
        {
            None => Ok(()),
            Some(name) => Err(FolderFault::Foreign(folder.to_owned(), name)),
        }
    }

    /// Lets `fill` write files into a hidden folder, which then takes the name `out`, in place of earlier results.
    ///
    /// # Errors
    /// Those of [`Self::check`], if a file cannot be written, or `fill` fails: then `out` is as it was.
    pub fn write<T, E: From<FolderFault>>(
        self,
        out: &Path,
        fill: impl FnOnce(&Path) -> Result<T, E>,
    ) -> Result<T, E> {
        self.check(out)?;
        let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty());
        if let Some(parent) = parent {
            fs::create_dir_all(parent).map_err(FolderFault::write(parent))?;
        }
        let out = &resolved(out);
        self.recover(out)?;
        let partial = hidden_beside(out, &format!("{}.partial", process::id()));
        let mut is_filled = false;
        let write = || {
            remove_own(&partial)?;
            fs::create_dir(&partial).map_err(FolderFault::write(&partial))?;
            let filled = fill(&partial)?;
            is_filled = true;
            self.replace(&partial, out, exchange)?;
            Ok(filled)
        };
        let written = write();
        if written.is_err() && !is_filled {
            // The first error is the one that counts.
            let _ = remove_own(&partial);
        }
        written
    }

    /// Restores what a killed run had moved away, or removes it if the new folder is in its place.
    fn recover(self, out: &Path) -> Result<(), FolderFault> {
        let earlier = hidden_beside(out, "earlier");
        if out.exists() {
            return self.remove(&earlier);
        }
        if earlier.exists() {
            publish(&earlier, out).map_err(FolderFault::write(out))?;
        }
        Ok(())
    }

    /// Puts a finished folder in the place of another.
    fn replace(
        self,
        partial: &Path,
        out: &Path,
        exchange: impl Fn(&Path, &Path) -> io::Result<()>,
    ) -> Result<(), FolderFault> {
        if !out.exists() {
            return publish(partial, out).map_err(FolderFault::write(out));
        }
        if exchange(partial, out).is_ok() {
            let parent = out.parent().unwrap_or(Path::new(""));
            sync_folder(parent).map_err(FolderFault::write(out))?;
            return self.remove(partial);
        }
        let earlier = hidden_beside(out, "earlier");
        fs::rename(out, &earlier).map_err(FolderFault::write(out))?;
        publish(partial, out)
            .map_err(FolderFault::write(out))
            .inspect_err(|_| {
                // The first error is the one that counts.
                let _ = fs::rename(&earlier, out);
            })?;
        self.remove(&earlier)
    }

    /// Removes a folder with the results in it; other content stays, with the folder, and is an error.
    fn remove(self, folder: &Path) -> Result<(), FolderFault> {
        if !folder.exists() {
            return Ok(());
        }
        for name in names_in(folder).map_err(FolderFault::read(folder))? {
            if (self.holds)(&name) {
                remove_own(&folder.join(name))?;
            }
        }
        fs::remove_dir(folder).map_err(FolderFault::write(folder))
    }
}

/// Removes a file, or a folder with all that is in it.
fn remove_own(path: &Path) -> Result<(), FolderFault> {
    let removed = match fs::symlink_metadata(path) {
        Err(_) => return Ok(()),
        Ok(found) if found.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
    };
    removed.map_err(FolderFault::write(path))
}

fn names_in(folder: &Path) -> io::Result<Vec<String>> {
    fs::read_dir(folder)?
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect()
}

/// Exchanges the names of two folders in one step.
#[cfg(target_os = "linux")]
fn exchange(a: &Path, b: &Path) -> io::Result<()> {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    Ok(renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE)?)
}

/// Exchanges the names of two folders in one step.
#[cfg(not(target_os = "linux"))]
fn exchange(_: &Path, _: &Path) -> io::Result<()> {
    Err(io::ErrorKind::Unsupported.into())
}

/// The folder itself where the path is a link to it.
fn resolved(out: &Path) -> PathBuf {
    fs::canonicalize(out).unwrap_or_else(|_| out.to_owned())
}

/// A hidden name beside a folder.
fn hidden_beside(out: &Path, ending: &str) -> PathBuf {
    let name = out.file_name().unwrap_or_default().to_string_lossy();
    out.with_file_name(format!(".{name}.{ending}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const MARKER: &str = "figures.json";
    const RESULTS: ResultFolder = ResultFolder {
        marker: MARKER,
        holds: |name| name == MARKER || name == "00",
    };

    /// Writes results: figures, and a sample in a folder of its own.
    fn write(out: &Path, text: &str) -> Result<(), FolderFault> {
        RESULTS.write(out, |folder| {
            let sample = folder.join("00");
            fs::create_dir(&sample).map_err(FolderFault::write(&sample))?;
            fs::write(sample.join("image.png"), text).map_err(FolderFault::write(&sample))?;
            fs::write(folder.join(MARKER), text).map_err(FolderFault::write(folder))
        })
    }

    fn sorted_names(folder: &Path) -> Vec<String> {
        let mut names = names_in(folder).unwrap();
        names.sort();
        names
    }

    fn figures(out: &Path) -> String {
        fs::read_to_string(out.join(MARKER)).unwrap()
    }

    #[test]
    fn the_earlier_folder_is_never_without_a_name_that_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        write(&out, "one").unwrap();
        // Killed between the two renames, where folders cannot be exchanged.
        fs::rename(&out, hidden_beside(&out, "earlier")).unwrap();
        RESULTS.check(&out).unwrap();
        let fault = || FolderFault::NoFolder(PathBuf::new());
        let failed = RESULTS.write(&out, |_| -> Result<(), _> { Err(fault()) });
        assert!(failed.is_err());
        assert_eq!(figures(&out), "one");
        write(&out, "two").unwrap();
        assert_eq!(figures(&out), "two");
        assert_eq!(sorted_names(folder.path()), ["out"]);
    }

    #[test]
    fn a_folder_with_anything_else_in_it_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        write(&out, "one").unwrap();
        fs::write(out.join("notes.txt"), "mine").unwrap();
        let fault = write(&out, "two").unwrap_err();
        assert!(matches!(fault, FolderFault::Foreign(_, name) if name == "notes.txt"));
        assert_eq!(figures(&out), "one");
        assert_eq!(sorted_names(folder.path()), ["out"]);
        // Without the marker, a folder of a result's name can be anything's.
        fs::create_dir_all(folder.path().join("other/00")).unwrap();
        let fault = write(&folder.path().join("other"), "two").unwrap_err();
        assert!(matches!(fault, FolderFault::Foreign(_, name) if name == "00"));
        fs::write(folder.path().join("file"), "mine").unwrap();
        let fault = write(&folder.path().join("file"), "two").unwrap_err();
        assert!(matches!(fault, FolderFault::NoFolder(_)));
    }

    #[test]
    fn without_an_exchange_the_folder_is_replaced_too() {
        let folder = tempfile::tempdir().unwrap();
        let (out, new) = (folder.path().join("out"), folder.path().join("new"));
        write(&out, "one").unwrap();
        write(&new, "two").unwrap();
        let unsupported = |_: &Path, _: &Path| Err(io::ErrorKind::Unsupported.into());
        RESULTS.replace(&new, &out, unsupported).unwrap();
        assert_eq!(figures(&out), "two");
        assert_eq!(sorted_names(folder.path()), ["out"]);
    }

    #[test]
    fn what_is_left_of_an_exchange_is_never_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let (out, new) = (folder.path().join("out"), folder.path().join("new"));
        write(&out, "one").unwrap();
        write(&new, "two").unwrap();
        // It came after the check.
        fs::write(out.join("notes.txt"), "mine").unwrap();
        assert!(RESULTS.replace(&new, &out, exchange).is_err());
        assert_eq!(figures(&out), "two");
        assert_eq!(sorted_names(&new), ["notes.txt"]);
    }
}
