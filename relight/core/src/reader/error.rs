//! Errors of a data set, and of one sample.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

use relit_data::causes::with_causes;
use relit_data::shard::ShardError;

use crate::image::ImageError;
use crate::parallel::JobPanic;

/// Why a data set cannot be opened, or a sample not be given.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The operating system refused.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// A shard is damaged, or an image in it does not decode.
    #[error(transparent)]
    Shard(#[from] ShardError),
    /// Reading it panicked.
    #[error(transparent)]
    Panic(#[from] JobPanic),
    /// An image does not decode, or has another size than those that it belongs to.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Any other fault, as a sentence.
    #[error("{0}")]
    Other(String),
}

impl ReadError {
    /// Puts the path to an operating system's reason.
    pub(super) fn read(path: &Path) -> impl Fn(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Read {
            path: path.clone(),
            source,
        }
    }

    /// Puts the path to a fault, and to what is expected.
    pub(super) fn file(path: &Path, fault: impl Display) -> Self {
        Self::Other(format!("{} {fault}", path.display()))
    }

    /// Puts the path to the fault of a shard or of the description of a data set.
    pub(super) fn dataset(path: &Path) -> impl FnOnce(ShardError) -> Self {
        let path = path.to_owned();
        move |fault| Self::file(&path, format!("cannot be used: {}", with_causes(&fault)))
    }

    /// A folder contains none of what is `expected`.
    pub(super) fn empty(path: &Path, expected: &str) -> Self {
        Self::file(path, format!("holds no samples: expected {expected}"))
    }

    /// Puts the path to what is wrong with numbers in a file.
    pub(super) fn numbers<E: Display>(path: &Path) -> impl FnOnce(E) -> Self {
        let path = path.to_owned();
        move |fault| Self::file(&path, format!("does not parse: {fault}"))
    }

    /// That the sample lacks a part, a suffix or a file's name.
    pub fn missing(part: &str) -> Self {
        Self::Other(format!("its {part} is missing"))
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
    pub fault: ReadError,
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
