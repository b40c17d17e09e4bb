//! A folder of results in the place of an earlier one: whole or not at all, and without the loss of anything else.
//!
//! The new folder is made under a hidden name beside the other, and the two are exchanged in one step where the
//! system can. Where it cannot, the earlier folder has the name `.<name>.earlier` for a moment; a run that was killed then has
//! left it there, and the next run puts it back.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process;

use relit_data::durable::{publish, sync_folder};

use super::error::DecomposeError;
use super::files::{FIGURES, FILES};

/// Whether a decomposition may be written to this folder.
pub(super) fn check(out: &Path) -> Result<(), DecomposeError> {
    let no_folder = |path: &Path| DecomposeError::NoFolder {
        path: path.to_owned(),
    };
    out.file_name().ok_or_else(|| no_folder(out))?;
    let exists = |path: &Path| fs::symlink_metadata(path).is_ok();
    if let Some(nearest) = out.ancestors().find(|path| exists(path))
        && !nearest.is_dir()
    {
        return Err(no_folder(nearest));
    }
    let out = &resolved(out);
    let earlier = hidden_beside(out, "earlier");
    for folder in [out, &earlier] {
        if exists(folder) {
            check_names(folder)?;
        }
    }
    Ok(())
}

/// Whether a folder is empty or holds the files of a decomposition and nothing else.
fn check_names(folder: &Path) -> Result<(), DecomposeError> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(DecomposeError::read(folder))? {
        let entry = entry.map_err(DecomposeError::read(folder))?;
        let is_file = entry.file_type().is_ok_and(|kind| !kind.is_dir());
        let name = entry.file_name().to_string_lossy().into_owned();
        found.push((is_file && FILES.contains(&name.as_str()), name));
    }
    // Without its figures, files of these names can be anything's.
    let has_figures = found.iter().any(|(_, name)| name == FIGURES);
    match found
        .into_iter()
        .find(|(is_ours, _)| !(*is_ours && has_figures))
    {
        None => Ok(()),
        Some((_, name)) => Err(DecomposeError::Foreign {
            path: folder.to_owned(),
            name,
        }),
    }
}

/// Lets `write` fill a new folder and puts it in the place of `out`, for which [`check`] found nothing wrong.
pub(super) fn with_folder<T>(
    out: &Path,
    write: impl FnOnce(&Path) -> Result<T, DecomposeError>,
) -> Result<T, DecomposeError> {
    let out = &resolved(out);
    recover(out)?;
    let partial = hidden_beside(out, &format!("{}.partial", process::id()));
    let fill = || {
        remove(&partial)?;
        fs::create_dir(&partial).map_err(DecomposeError::write(&partial))?;
        let written = write(&partial)?;
        replace(&partial, out, exchange)?;
        Ok(written)
    };
    fill().inspect_err(|_| {
        // The first error is the one that counts.
        let _ = remove(&partial);
    })
}

/// Puts back what a run that was killed had moved away, or removes it where the new folder is in its place.
fn recover(out: &Path) -> Result<(), DecomposeError> {
    let earlier = hidden_beside(out, "earlier");
    if out.exists() {
        return remove(&earlier);
    }
    if earlier.exists() {
        publish(&earlier, out).map_err(DecomposeError::write(out))?;
    }
    Ok(())
}

/// Puts a finished folder in the place of another.
fn replace(
    partial: &Path,
    out: &Path,
    exchange: impl Fn(&Path, &Path) -> io::Result<()>,
) -> Result<(), DecomposeError> {
    if !out.exists() {
        return publish(partial, out).map_err(DecomposeError::write(out));
    }
    if exchange(partial, out).is_ok() {
        let parent = out.parent().unwrap_or(Path::new(""));
        sync_folder(parent).map_err(DecomposeError::write(out))?;
        return remove(partial);
    }
    let earlier = hidden_beside(out, "earlier");
    fs::rename(out, &earlier).map_err(DecomposeError::write(out))?;
    publish(partial, out)
        .map_err(DecomposeError::write(out))
        .inspect_err(|_| {
            // The first error is the one that counts.
            let _ = fs::rename(&earlier, out);
        })?;
    remove(&earlier)
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

/// Removes a folder with the files of a decomposition in it; what else it holds stays, with the folder, and is an
/// error. Files that are written are under names of their own until they are whole.
fn remove(folder: &Path) -> Result<(), DecomposeError> {
    if !folder.exists() {
        return Ok(());
    }
    for name in FILES {
        match fs::remove_file(folder.join(name)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(DecomposeError::write(folder)(error));
            }
            _ => {}
        }
    }
    fs::remove_dir(folder).map_err(DecomposeError::write(folder))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes a decomposition that is nothing but its figures.
    fn write(out: &Path, text: &str) -> Result<(), DecomposeError> {
        with_folder(out, |folder| {
            fs::write(folder.join(FIGURES), text).map_err(DecomposeError::write(folder))
        })
    }

    fn names_in(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn figures(out: &Path) -> String {
        fs::read_to_string(out.join(FIGURES)).unwrap()
    }

    #[test]
    fn the_earlier_folder_is_never_without_a_name_that_is_found_again() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        write(&out, "one").unwrap();
        // Killed between the two renames, where folders cannot be exchanged.
        fs::rename(&out, hidden_beside(&out, "earlier")).unwrap();
        check(&out).unwrap();
        let failed = with_folder(&out, |_| -> Result<(), _> {
            Err(DecomposeError::EmptyMask)
        });
        assert!(failed.is_err());
        assert_eq!(figures(&out), "one");
        write(&out, "two").unwrap();
        assert_eq!(figures(&out), "two");
        assert_eq!(names_in(folder.path()), ["out"]);
    }

    #[test]
    fn without_an_exchange_the_folder_is_replaced_too() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        write(&out, "one").unwrap();
        let new = folder.path().join("new");
        write(&new, "two").unwrap();
        let unsupported = |_: &Path, _: &Path| Err(io::ErrorKind::Unsupported.into());
        replace(&new, &out, unsupported).unwrap();
        assert_eq!(figures(&out), "two");
        assert_eq!(names_in(folder.path()), ["out"]);
    }

    #[test]
    fn what_is_left_of_an_exchange_is_never_another_file() {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        write(&out, "one").unwrap();
        let new = folder.path().join("new");
        write(&new, "two").unwrap();
        // It came after the check.
        fs::write(out.join("notes.txt"), "mine").unwrap();
        assert!(replace(&new, &out, exchange).is_err());
        assert_eq!(figures(&out), "two");
        assert_eq!(names_in(&new), ["notes.txt"]);
    }
}
