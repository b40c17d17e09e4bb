//! Folders of results that appear whole or not at all. Knows nothing of what they hold.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process;

use relit_data::durable::publish;

/// Why a folder is not written.
#[derive(Debug)]
pub(crate) enum FolderFault {
    /// It holds something else.
    Foreign(PathBuf),
    /// It cannot be read.
    Read(PathBuf, io::Error),
    /// It, or what it lies in, cannot be written.
    Write(PathBuf, io::Error),
}

impl FolderFault {
    fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write(path, source)
    }
}

/// Has `fill` write files into a hidden folder beside `out`, which then takes its name, in place of an earlier
/// result: a folder in which there is a file `marker`.
///
/// # Errors
/// Where `out` holds something else, a file cannot be written, or `fill` fails: then `out` is as it was.
pub(crate) fn write_folder<T, E: From<FolderFault>>(
    out: &Path,
    marker: &str,
    fill: impl FnOnce(&Path) -> Result<T, E>,
) -> Result<T, E> {
    check_free(out, marker)?;
    let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty());
    if let Some(parent) = parent {
        fs::create_dir_all(parent).map_err(FolderFault::write(parent))?;
    }
    let partial = hidden_beside(out, "partial")?;
    let write = || {
        remove_folder(&partial)?;
        fs::create_dir(&partial).map_err(FolderFault::write(&partial))?;
        let filled = fill(&partial)?;
        replace(&partial, out)?;
        Ok(filled)
    };
    write().inspect_err(|_| {
        // The first error is the one that counts.
        let _ = fs::remove_dir_all(&partial);
    })
}

/// Whether results may be written to this folder.
fn check_free(out: &Path, marker: &str) -> Result<(), FolderFault> {
    if !out.exists() || out.join(marker).is_file() {
        return Ok(());
    }
    let foreign = || FolderFault::Foreign(out.to_owned());
    if !out.is_dir() {
        return Err(foreign());
    }
    let mut entries =
        fs::read_dir(out).map_err(|source| FolderFault::Read(out.to_owned(), source))?;
    match entries.next() {
        None => Ok(()),
        Some(_) => Err(foreign()),
    }
}

/// Puts a finished folder in the place of another.
fn replace(partial: &Path, out: &Path) -> Result<(), FolderFault> {
    let old = hidden_beside(out, "old")?;
    remove_folder(&old)?;
    let had_old = out.exists();
    if had_old {
        fs::rename(out, &old).map_err(FolderFault::write(out))?;
    }
    publish(partial, out)
        .map_err(FolderFault::write(out))
        .inspect_err(|_| {
            if had_old {
                // The first error is the one that counts.
                let _ = fs::rename(&old, out);
            }
        })?;
    remove_folder(&old)
}

/// A hidden name beside a folder that no other process uses.
fn hidden_beside(out: &Path, ending: &str) -> Result<PathBuf, FolderFault> {
    let name = out
        .file_name()
        .ok_or_else(|| FolderFault::Foreign(out.to_owned()))?;
    let name = name.to_string_lossy();
    Ok(out.with_file_name(format!(".{name}.{}.{ending}", process::id())))
}

fn remove_folder(folder: &Path) -> Result<(), FolderFault> {
    if folder.exists() {
        fs::remove_dir_all(folder).map_err(FolderFault::write(folder))?;
    }
    Ok(())
}
