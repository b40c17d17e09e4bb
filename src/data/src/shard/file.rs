//! The files of a data set as `dataset.json` lists them, and whether they are still as it says.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::dataset::{Dataset, ShardEntry};
use super::digest::Digest;
use super::new_dataset::FolderImages;
use super::settings::Layout;
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
    pub(super) fn check(&self, out: &Path) -> Result<(), ShardError> {
        names::check_path(&self.file)?;
        let path = out.join(&self.file);
        let found = Digest::hash_file(&path).map_err(ShardError::io("read", &path))?;
        compare(&self.file, (self.bytes, self.blake3), found)
    }
}

/// The tar as a file.
impl From<&ShardEntry> for FileEntry {
    fn from(shard: &ShardEntry) -> Self {
        Self {
            file: shard.file.clone(),
            bytes: shard.bytes,
            blake3: shard.blake3,
        }
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
    let what = if found.0 != expected.0 {
        format!("it has {} bytes, not {}", found.0, expected.0)
    } else if found.1 != expected.1 {
        format!("its BLAKE3 is {}, not {}", found.1, expected.1)
    } else {
        return Ok(());
    };
    Err(changed(file, what))
}

/// The content of a file of at most `limit` bytes.
pub(super) fn read_limited(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let length = File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
    if length as u64 > limit {
        let what = format!("it has more than {limit} bytes");
        return Err(io::Error::other(what));
    }
    Ok(bytes)
}

/// That something in the data set is not what its description says.
pub(super) fn changed(file: &str, what: String) -> ShardError {
    ShardError::Changed {
        file: file.to_owned(),
        what,
    }
}

impl Dataset {
    /// Checks that the session `id` is listed and that each of its files in the data set `out` exists
    /// with the listed length and BLAKE3. Every file is read once, but not decoded: [`verify`] does
    /// that. Settings, source and mask are for the caller to compare.
    ///
    /// # Errors
    /// [`ShardError::Changed`] or [`ShardError::Io`].
    ///
    /// [`verify`]: super::verify()
    pub fn check_integrity(&self, out: &Path, id: &str) -> Result<(), ShardError> {
        let session = self.session(id);
        let session = session.ok_or_else(|| changed(id, "no such session is listed".to_owned()))?;
        for entry in std::iter::once(&session.table).chain(&session.report) {
            entry.check(out)?;
        }
        if self.shards_of(id).next().is_none() {
            return Err(changed(id, "it has no shard".to_owned()));
        }
        self.shards_of(id)
            .try_for_each(|shard| check_shard(out, shard, self.settings.layout))
    }
}

fn check_shard(out: &Path, shard: &ShardEntry, layout: Layout) -> Result<(), ShardError> {
    for entry in shard.mask.iter().chain(&shard.mean_img) {
        entry.check(out)?;
    }
    if layout == Layout::Webdataset {
        return FileEntry::from(shard).check(out);
    }
    names::check_path(&shard.file)?;
    let mut images = FolderImages::default();
    for index in 0..shard.samples {
        images.read(out, shard, index)?;
    }
    images.check(shard)
}
