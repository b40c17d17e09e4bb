//! Whether files are the ones that `dataset.json` vouches for.

use std::path::Path;

use super::dataset::{Dataset, FileEntry, ShardEntry};
use super::digest::{Digest, FolderHasher};
use super::settings::Layout;
use super::{Error, names};

impl Dataset {
    /// Whether the data set vouches for a session: it is entered, and each of its files is there
    /// with its size and BLAKE3. The files are read once. Settings, input and mask are for the
    /// caller to compare.
    ///
    /// # Errors
    /// The reason why it does not: [`Error::NoSession`], [`Error::NoShard`], [`Error::Changed`]
    /// or [`Error::Io`].
    pub fn vouches_for(&self, out: &Path, id: &str) -> Result<(), Error> {
        let unknown = || Error::NoSession {
            session: id.to_owned(),
        };
        let session = self.session(id).ok_or_else(unknown)?;
        for entry in std::iter::once(&session.table).chain(&session.report) {
            check_file(out, entry)?;
        }
        if self.shards_of(id).next().is_none() {
            return Err(Error::NoShard {
                session: id.to_owned(),
            });
        }
        self.shards_of(id)
            .try_for_each(|shard| check_shard(out, shard, self.settings.layout))
    }
}

/// Whether a file is there and is the one of its entry.
pub(super) fn check_file(out: &Path, entry: &FileEntry) -> Result<(), Error> {
    names::check_path(&entry.file)?;
    let path = out.join(&entry.file);
    let (bytes, blake3) = Digest::of_file(&path).map_err(Error::io("read", &path))?;
    compare(&entry.file, (entry.bytes, entry.blake3), (bytes, blake3))
}

/// Compares length and digest, as they should be and as they are.
pub(super) fn compare(
    file: &str,
    expected: (u64, Digest),
    found: (u64, Digest),
) -> Result<(), Error> {
    let changed = |what| {
        Err(Error::Changed {
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

fn check_shard(out: &Path, shard: &ShardEntry, layout: Layout) -> Result<(), Error> {
    for beside in shard.mask.iter().chain(&shard.mean_img) {
        check_file(out, beside)?;
    }
    if layout == Layout::Webdataset {
        let ShardEntry {
            file,
            bytes,
            blake3,
            ..
        } = shard.clone();
        return check_file(
            out,
            &FileEntry {
                file,
                bytes,
                blake3,
            },
        );
    }
    names::check_path(&shard.file)?;
    let mut hasher = FolderHasher::default();
    let mut total = 0;
    for index in 0..shard.samples {
        let path = out.join(&shard.file).join(format!("{index}.png"));
        let (bytes, digest) = Digest::of_file(&path).map_err(Error::io("read", &path))?;
        hasher.add(&digest);
        total += bytes;
    }
    compare(
        &shard.file,
        (shard.bytes, shard.blake3),
        (total, hasher.finish()),
    )
}
