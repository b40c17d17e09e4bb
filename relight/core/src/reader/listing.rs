//! What folders hold.

use std::path::{Path, PathBuf};

use crate::reader::ReadError;

/// The `wanted` paths of a folder, sorted; hidden names are left out.
pub(super) fn listed(
    folder: &Path,
    wanted: impl Fn(&Path) -> bool,
) -> Result<Vec<PathBuf>, ReadError> {
    let failed = ReadError::read(folder);
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(&failed)? {
        let entry = entry.map_err(&failed)?;
        let hidden = entry.file_name().as_encoded_bytes().starts_with(b".");
        let path = entry.path();
        if !hidden && wanted(&path) {
            paths.push(path);
        }
    }
    paths.sort();
    Ok(paths)
}
