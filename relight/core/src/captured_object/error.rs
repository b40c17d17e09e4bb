//! Why a captured object cannot be read or written.

use std::io;
use std::path::PathBuf;

use crate::image::{Extent, ImageError};

/// Why a captured object cannot be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CapturedObjectError {
    /// The file cannot be read.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// The file is no captured object.
    #[error("{} is no object that relight can light", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Why.
        source: Box<Self>,
    },
    /// The file is larger than is read.
    #[error("it has {bytes} bytes, and at most {most} are read")]
    TooLarge {
        /// Its size.
        bytes: u64,
        /// The largest that is read.
        most: u64,
    },
    /// The archive is damaged, or no archive.
    #[error("it is no ZIP archive, or damaged")]
    Archive(#[from] zip::result::ZipError),
    /// An entry is not there or cannot be read.
    #[error("its entry {entry} is missing or damaged: {reason}")]
    Entry {
        /// The entry.
        entry: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// Another kind of file, or one of a later version.
    #[error(
        "it says that it is \"{found}\", and this program reads \"relight.asset/1\": a newer relight may read it"
    )]
    Schema {
        /// What it says.
        found: String,
    },
    /// It has no pixels or too many.
    #[error("{} x {} pixels are not from 1 x 1 to 8192 a side and 16777216 in all", extent.width, extent.height)]
    Size {
        /// Its size.
        extent: Extent,
    },
    /// Maps do not fit together.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The file cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
}

impl CapturedObjectError {
    /// For a closure that knows why an entry is of no use.
    pub(super) fn entry<E: ToString>(entry: &'static str) -> impl Fn(E) -> Self {
        move |reason| Self::Entry {
            entry,
            reason: reason.to_string(),
        }
    }
}
