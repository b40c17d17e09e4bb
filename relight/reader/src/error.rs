//! Why a data set, or one sample of it, cannot be given.

use std::io;
use std::path::{Path, PathBuf};

use relit_data::causes::with_causes;

use relight_core::image::{Extent, ImageError};
use relight_core::parallel::JobPanic;

/// Why a data set cannot be opened.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
        /// What is wrong.
        source: relit_data::shard::ShardError,
    },
    /// A file of which nothing can be read.
    #[error(
        "{} holds no sample that can be read ({why}): give a shard (.tar) as relit-extract writes them",
        path.display()
    )]
    NoShard {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// There is nothing in it.
    #[error("{} holds no samples: {expected} were expected in it", path.display())]
    Empty {
        /// The folder.
        path: PathBuf,
        /// What should be there.
        expected: &'static str,
    },
    /// Folders whose files belong together in order do not have equally many.
    #[error("{} has {found} files and {} has {expected}: they cannot be paired", path.display(), other.display())]
    Unpaired {
        /// One folder.
        path: PathBuf,
        /// How many files it has.
        found: usize,
        /// The other folder.
        other: PathBuf,
        /// How many files that one has.
        expected: usize,
    },
    /// A thread cannot be started.
    #[error("a thread for decoding cannot be started")]
    Thread(#[source] io::Error),
}

/// Why a sample cannot be given.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
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
    /// The sample lacks a part.
    #[error("its {part} is missing")]
    Missing {
        /// The part, as a suffix or a file's name.
        part: String,
    },
    /// The frame's record does not parse.
    #[error("its record does not parse")]
    Record(#[source] serde_json::Error),
    /// An image does not decode.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// An image does not have the size of the others that it belongs to.
    #[error("its {part} has {}x{} pixels where {}x{} are needed", found.width, found.height, expected.width, expected.height)]
    Size {
        /// The part.
        part: &'static str,
        /// Its size.
        found: Extent,
        /// The size that it should have.
        expected: Extent,
    },
    /// A file of NumPy holds no picture.
    #[error("{}: {fault}", path.display())]
    Array {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        fault: String,
    },
    /// A file of numbers does not parse.
    #[error("{} does not parse", path.display())]
    Numbers {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// It was found to be lost when the data set was opened.
    #[error("{why}")]
    Lost {
        /// What is wrong, with its causes.
        why: String,
    },
}

impl SampleFault {
    /// Puts the path to an operating system's reason.
    pub(super) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Read { path, source }
    }

    /// Puts the path to what is wrong with numbers in a file.
    pub(super) fn numbers<E>(path: &Path) -> impl FnOnce(E) -> Self
    where
        E: std::error::Error + Send + Sync + 'static,
    {
        let path = path.to_owned();
        |source| Self::Numbers {
            path,
            source: Box::new(source),
        }
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

/// A batch of which samples are damaged. What is whole of it is there as well: who wants to go on
/// without the rest takes it, and has seen that something is missing.
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

/// Whether a part has the size of the others.
pub(super) fn check_extent(
    part: &'static str,
    found: Extent,
    expected: Extent,
) -> Result<(), SampleFault> {
    if found == expected {
        return Ok(());
    }
    Err(SampleFault::Size {
        part,
        found,
        expected,
    })
}
