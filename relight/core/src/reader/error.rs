//! Errors of a data set, and of one sample.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

use relit_data::causes::with_causes;

use crate::image::ImageError;
use crate::parallel::JobPanic;

/// Why a data set cannot be opened.
#[derive(Debug, thiserror::Error)]
pub enum OpenError {
    /// The operating system refused.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A shard or the description of a data set cannot be used.
    #[error("{} cannot be used", path.display())]
    Dataset {
        /// The file or folder.
        path: PathBuf,
        /// The fault.
        source: relit_data::shard::ShardError,
    },
    /// It contains no samples, or its files do not belong together.
    #[error("{} {fault}", path.display())]
    Content {
        /// The file or folder.
        path: PathBuf,
        /// The fault, and what is expected.
        fault: String,
    },
    /// A thread cannot be started.
    #[error("a thread for decoding cannot be started")]
    Thread(#[source] io::Error),
}

impl OpenError {
    /// A folder contains none of what is `expected`.
    pub(super) fn empty(path: &Path, expected: &str) -> Self {
        Self::Content {
            path: path.to_owned(),
            fault: format!("holds no samples: expected {expected}"),
        }
    }
}

/// Why a sample cannot be given.
#[derive(Debug, thiserror::Error)]
pub enum SampleFault {
    /// The operating system refused.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The shard is damaged there, or the image does not decode.
    #[error(transparent)]
    Shard(#[from] relit_data::shard::ShardError),
    /// Reading it panicked.
    #[error(transparent)]
    Panic(#[from] JobPanic),
    /// An image does not decode, or has another size than those that it belongs to.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A part is missing, lost or of no use.
    #[error("{0}")]
    Part(String),
}

impl SampleFault {
    /// Puts the path to an operating system's reason.
    pub(super) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Read { path, source }
    }

    /// Puts the path to what is wrong with numbers in a file.
    pub(super) fn numbers<E: Display>(path: &Path) -> impl FnOnce(E) -> Self {
        let path = path.to_owned();
        move |fault| Self::Part(format!("{} does not parse: {fault}", path.display()))
    }

    /// That the sample lacks a part, a suffix or a file's name.
    pub fn missing(part: &str) -> Self {
        Self::Part(format!("its {part} is missing"))
    }
}

/// A sample that cannot be given, by its name.
#[derive(Debug, thiserror::Error)]
#[error("{sample}")]
pub struct DamagedSample {
    /// Which sample: file and place in it.
    pub sample: String,
    /// Why.
    #[source]
    pub fault: SampleFault,
}

/// A batch with damaged samples. Its intact samples are included: a caller that accepts the loss
/// can go on with them.
#[derive(Debug, thiserror::Error)]
#[error("{} samples of a batch are damaged: {}", damage.len(), listed(damage))]
pub struct DamagedBatch<B> {
    /// The batch with the samples that are whole.
    pub rest: B,
    /// The samples that are not, at least one.
    pub damage: Vec<DamagedSample>,
}

fn listed(damage: &[DamagedSample]) -> String {
    let texts: Vec<String> = damage.iter().map(|one| with_causes(one)).collect();
    texts.join("; ")
}
