//! The folders of files that are written.

use std::fs;
use std::io;
use std::path::Path;

/// Makes the folder of a file that is to be written, and those that it lies in.
pub(super) fn make_parent(path: &Path) -> io::Result<()> {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => fs::create_dir_all(folder),
        _ => Ok(()),
    }
}
