//! Why an evaluation cannot be made.

use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

use relight_core::image::{Extent, ImageError};
use relight_core::reader::{DamagedSample, ReadError};

/// Why something failed.
type Cause = Box<dyn Error + Send + Sync>;

/// Why an evaluation cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// The ground truth cannot be opened.
    #[error(transparent)]
    Open(#[from] ReadError),
    /// A sample of the ground truth cannot be read.
    #[error("the ground truth is damaged")]
    Damage(#[from] DamagedSample),
    /// Ground truth and predictions do not have what the protocol needs.
    #[error("{0}")]
    Unfit(String),
    /// A prediction cannot be read.
    #[error("a prediction cannot be read")]
    Prediction(#[from] ImageError),
    /// A file or folder cannot be used.
    #[error("{} {fault}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// The fault.
        fault: &'static str,
        /// Why.
        source: Cause,
    },
    /// A sample cannot be decomposed, relit or measured.
    #[error("{sample} {fault}")]
    Sample {
        /// The sample.
        sample: String,
        /// What cannot be done with it.
        fault: &'static str,
        /// Why.
        source: Cause,
    },
    /// Objects cannot be made.
    #[error(transparent)]
    Synth(#[from] relight_synth::SynthError),
    /// A turn cannot be solved.
    #[error("a turn cannot be solved")]
    Turn(#[source] Box<relight_turn::TurnError>),
}

impl EvalError {
    /// Puts the path, and what is wrong with it, to a reason.
    pub(super) fn file<C: Into<Cause>>(path: &Path, fault: &'static str) -> impl FnOnce(C) -> Self {
        let path = path.to_owned();
        move |source| Self::File {
            path,
            fault,
            source: source.into(),
        }
    }

    /// Puts the path to an operating system's reason.
    pub(super) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        Self::file(path, "cannot be read")
    }

    /// Puts the path to an operating system's reason.
    pub(super) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        Self::file(path, "cannot be written")
    }

    /// Puts the sample, and what cannot be done with it, to a reason.
    pub(super) fn sample<C: Into<Cause>>(
        sample: &str,
        fault: &'static str,
    ) -> impl FnOnce(C) -> Self {
        let sample = sample.to_owned();
        move |source| Self::Sample {
            sample,
            fault,
            source: source.into(),
        }
    }

    /// A description of another version than this one reads.
    pub(super) fn schema(path: &Path, found: &str, expected: &str) -> Self {
        let path = path.display();
        Self::Unfit(format!(
            "{path} says {found:?}, this version reads {expected:?}"
        ))
    }

    /// An estimate of another size than its ground truth.
    pub(super) fn size(path: &Path, found: Extent, expected: Extent) -> Self {
        let [found, expected] =
            [found, expected].map(|size| format!("{}x{}", size.width, size.height));
        let path = path.display();
        Self::Unfit(format!(
            "{path} has {found} pixels, its ground truth {expected}"
        ))
    }
}

impl From<relight_turn::TurnError> for EvalError {
    fn from(fault: relight_turn::TurnError) -> Self {
        Self::Turn(Box::new(fault))
    }
}
