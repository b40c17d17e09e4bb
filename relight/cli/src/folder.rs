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
