//! What differs between one state of a file and another.

use std::fs;
use std::path::Path;
use std::time::SystemTime;

/// Length and time of the last change of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct FileVersion {
    bytes: u64,
    modified: Option<SystemTime>,
}

impl FileVersion {
    /// `None` where there is no such file.
    pub(super) fn of(path: &Path) -> Option<Self> {
        let data = fs::metadata(path).ok().filter(fs::Metadata::is_file)?;
        Some(Self {
            bytes: data.len(),
            modified: data.modified().ok(),
        })
    }
}
