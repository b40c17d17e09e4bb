//! Folders that commands write into.

use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;

/// The folder that a verb writes its results into.
#[derive(Args)]
pub(crate) struct OutputFolder {
    /// The folder for the results; created if missing.
    #[arg(short, long, value_name = "DIR")]
    pub(crate) output: PathBuf,
}

/// Makes a folder, with those that it lies in.
pub(super) fn make_folder(path: &Path) -> Result<(), String> {
    fs::create_dir_all(path).map_err(|error| format!("{} cannot be made: {error}", path.display()))
}

/// The same, and nothing is in it.
pub(super) fn make_empty_folder(path: &Path) -> Result<(), String> {
    make_folder(path)?;
    let entries = fs::read_dir(path);
    let mut entries =
        entries.map_err(|error| format!("{} cannot be read: {error}", path.display()))?;
    match entries.next() {
        None => Ok(()),
        Some(_) => Err(format!(
            "{} is not empty: give a new or empty folder",
            path.display()
        )),
    }
}
