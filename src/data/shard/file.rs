//! A file of a data set as `dataset.json` lists it: path, length and digest.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::digest::Digest;
use super::{ShardError, names};

/// A file that `dataset.json` lists.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct FileEntry {
    /// Path relative to the data set, with `/`.
    pub file: String,
    /// Its length, bytes.
    pub bytes: u64,
    /// BLAKE3 of its bytes.
    pub blake3: Digest,
}

impl FileEntry {
    /// Checks that the file exists in the data set `out` and has this length and digest.
    ///
    /// # Errors
    /// [`ShardError::Changed`] if it differs, [`ShardError::UnsafePath`], or [`ShardError::Io`].
    pub(super) fn check(&self, out: &Path) -> Result<(), ShardError> {
        names::check_path(&self.file)?;
        let path = out.join(&self.file);
        let found = Digest::of_file(&path).map_err(ShardError::io("read", &path))?;
        compare(&self.file, (self.bytes, self.blake3), found)
    }
}

/// Compares the expected length and digest of `file` with those that were found.
///
/// # Errors
/// [`ShardError::Changed`] if they differ.
pub(super) fn compare(
    file: &str,
    expected: (u64, Digest),
    found: (u64, Digest),
) -> Result<(), ShardError> {
    let changed = |what| {
        Err(ShardError::Changed {
            file: file.to_owned(),
            what,
        })
    };
    if found.0 != expected.0 {
        return changed(format!("it has {} bytes, not {}", found.0, expected.0));
    }
    if found.1 != expected.1 {
        return changed(format!("its BLAKE3 is {}, not {}", found.1, expected.1));
    }
    Ok(())
}
