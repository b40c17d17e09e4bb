//! The errors of reading and writing data sets.

use std::io;
use std::path::{Path, PathBuf};

use parquet::errors::ParquetError;

use crate::disk::{DISK_FULL, is_full};

/// Why a data set could not be written, read or checked.
#[derive(Debug, thiserror::Error)]
pub enum ShardError {
    /// A file or folder could not be read or written.
    #[error(
        "could not {doing} {path}: check that it exists, may be read and written, and that the disk has space",
        path = .path.display()
    )]
    Io {
        /// What was attempted, as a verb.
        doing: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// The disk is full.
    #[error(
        "{DISK_FULL}: {what} needs about {} in {folder} until it is written, and had {}; free some space, or give another folder",
        in_megabytes(*needed), in_megabytes(*written), folder = .folder.display()
    )]
    DiskFull {
        /// The session or file.
        what: String,
        /// The data set's folder.
        folder: PathBuf,
        /// Bytes that it needs until all is written.
        needed: u64,
        /// Bytes of them that were written.
        written: u64,
        /// The system's error: the disk, a quota or a limit on file sizes is exhausted.
        source: io::Error,
    },
    /// The pieces of several tasks do not make a data set.
    #[error(
        "the tasks' pieces in {path} do not make a whole data set: {}", .problems.join("; "), path = .path.display()
    )]
    PartialManifests {
        /// The folder of the pieces.
        path: PathBuf,
        /// What is wrong, one sentence each.
        problems: Vec<String>,
    },
    /// Another process is writing into the folder.
    #[error(
        "{} is being written by another process: wait for it to end, or give another folder", .0.display()
    )]
    Locked(PathBuf),
    /// The session is being written already, or a killed run left its spool behind.
    #[error(
        "{} exists: either the session is being written already, or a killed run left it (the next locked run removes it)",
        .0.display()
    )]
    Busy(PathBuf),
    /// A session, sample, name or description that is not taken.
    #[error("{0}")]
    Refused(String),
    /// An image or mask that cannot be encoded, or a PNG that is not what is expected.
    #[error("{0}")]
    Image(String),
    /// A table that could not be written or read.
    #[error("the table {path} could not be {doing}", path = .path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// What was attempted: "written" or "read".
        doing: &'static str,
        /// The Parquet library's error, or what is wrong with the content.
        source: ParquetError,
    },
    /// `dataset.json`, or a task's piece of it, is damaged or of another version.
    #[error("{path} is not a usable description of a data set: {what}", path = .path.display())]
    Description {
        /// The file.
        path: PathBuf,
        /// What is wrong, and what to do.
        what: String,
    },
    /// A folder without `dataset.json`.
    #[error(
        "{} holds no dataset.json: give the folder that relit-extract wrote", .0.display()
    )]
    NoDataset(PathBuf),
    /// A file of the data set is not the one that was written.
    #[error("{file} differs from its entry in dataset.json: {what}")]
    Changed {
        /// The file, relative to the data set, or the session.
        file: String,
        /// How it differs.
        what: String,
    },
    /// A tar that ends too early.
    #[error("the shard is truncated: it ends at byte {0}; copy it again")]
    ShardTruncated(u64),
    /// A tar that is damaged, or has members that are not those of a shard.
    #[error("the shard is damaged at byte {offset}: {what}")]
    ShardDamaged {
        /// Where the header of the block or member starts.
        offset: u64,
        /// What is wrong there.
        what: String,
    },
    /// A shard that could not be read.
    #[error(
        "could not read the shard at byte {offset}: check the disk or connection that it comes from, and read it again"
    )]
    ShardRead {
        /// Number of bytes that were read.
        offset: u64,
        /// The system's error.
        source: io::Error,
    },
}

/// A number of bytes for a reader.
fn in_megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 / 1e6)
}

impl ShardError {
    /// The same error, or if it says that no more can be written, that `what` needs so many bytes in the
    /// folder, after so many were written.
    pub(super) fn with_needs(self, what: &str, folder: &Path, needed: u64, written: u64) -> Self {
        let source = match self {
            Self::Io { source, .. } if is_full(&source) => source,
            Self::Table {
                source: ParquetError::External(source),
                ..
            } if source.downcast_ref().is_some_and(is_full) => io::Error::other(source),
            other => return other,
        };
        Self::DiskFull {
            what: what.to_owned(),
            folder: folder.to_owned(),
            needed,
            written,
            source,
        }
    }

    /// For `map_err`: an I/O error with what was attempted and the path.
    pub fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io {
            doing,
            path: path.to_owned(),
            source,
        }
    }

    /// That reading the shard cannot go on: nothing follows of it.
    pub(super) fn ends_the_shard(&self) -> bool {
        matches!(self, Self::ShardRead { .. } | Self::ShardTruncated(_))
    }
}
