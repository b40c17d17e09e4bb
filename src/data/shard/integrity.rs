//! The check of a session's files against the lengths and digests in `dataset.json`.

use std::path::Path;

use super::dataset::{Dataset, ShardEntry};
use super::digest::{Digest, FolderHasher};
use super::file::{FileEntry, compare};
use super::settings::Layout;
use super::{ShardError, names};

impl Dataset {
    /// Checks that the session `id` is listed and that each of its files in the data set `out` exists
    /// with the listed length and BLAKE3. Every file is read once, but not decoded: [`verify`] does
    /// that. Settings, source and mask are for the caller to compare.
    ///
    /// # Errors
    /// [`ShardError::NoSession`], [`ShardError::NoShard`], [`ShardError::Changed`] or [`ShardError::Io`].
    ///
    /// [`verify`]: super::verify()
    pub fn check_integrity(&self, out: &Path, id: &str) -> Result<(), ShardError> {
        let unknown = || ShardError::NoSession {
            session: id.to_owned(),
        };
        let session = self.session(id).ok_or_else(unknown)?;
        for entry in std::iter::once(&session.table).chain(&session.report) {
            entry.check(out)?;
        }
        if self.shards_of(id).next().is_none() {
            return Err(ShardError::NoShard {
                session: id.to_owned(),
            });
        }
        self.shards_of(id)
            .try_for_each(|shard| check_shard(out, shard, self.settings.layout))
    }
}

fn check_shard(out: &Path, shard: &ShardEntry, layout: Layout) -> Result<(), ShardError> {
    for entry in shard.mask.iter().chain(&shard.mean_img) {
        entry.check(out)?;
    }
    match layout {
        Layout::Webdataset => {
            let (bytes, blake3) = (shard.bytes, shard.blake3);
            let file = shard.file.clone();
            FileEntry {
                file,
                bytes,
                blake3,
            }
            .check(out)
        }
        Layout::Relit => check_folder(out, shard),
    }
}

fn check_folder(out: &Path, shard: &ShardEntry) -> Result<(), ShardError> {
    names::check_path(&shard.file)?;
    let mut hasher = FolderHasher::default();
    let mut total = 0;
    for index in 0..shard.samples {
        let path = out.join(&shard.file).join(format!("{index}.png"));
        let (bytes, digest) = Digest::of_file(&path).map_err(ShardError::io("read", &path))?;
        hasher.add(&digest);
        total += bytes;
    }
    let expected = (shard.bytes, shard.blake3);
    compare(&shard.file, expected, (total, hasher.finish()))
}
