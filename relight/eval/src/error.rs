//! Why an evaluation cannot be made.

use std::error::Error;
use std::fmt::Display;
use std::path::Path;

use relight_core::image::ImageError;
use relight_reader::{DamagedSample, OpenError};

/// Why an evaluation cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvalError {
    /// The ground truth cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A sample of the ground truth cannot be read.
    #[error("the ground truth is damaged")]
    Damage(#[from] DamagedSample),
    /// A prediction cannot be read.
    #[error("a prediction cannot be read")]
    Prediction(#[from] ImageError),
    /// A turn cannot be solved.
    #[error("a turn cannot be solved")]
    Turn(#[source] Box<relight_turn::TurnError>),
    /// Objects cannot be made.
    #[error(transparent)]
    Synth(#[from] relight_synth::SynthError),
    /// What failed, and why where something else knows it.
    #[error("{what}")]
    Failed {
        /// What failed.
        what: String,
        /// The reason.
        source: Option<Box<dyn Error + Send + Sync>>,
    },
}

impl EvalError {
    /// What is wrong.
    pub(super) fn fault(what: String) -> Self {
        Self::Failed { what, source: None }
    }

    /// Puts what failed to its reason.
    pub(super) fn of<E: Error + Send + Sync + 'static>(
        what: impl Display,
    ) -> impl FnOnce(E) -> Self {
        move |source| Self::Failed {
            what: what.to_string(),
            source: Some(Box::new(source)),
        }
    }

    /// Puts the path of a file that cannot be read to the reason.
    pub(super) fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        Self::of(format!("{} cannot be read", path.display()))
    }

    /// Puts the path of a file or folder that cannot be written to the reason.
    pub(super) fn write(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        Self::of(format!("{} cannot be written", path.display()))
    }

    /// Puts the path of a description to what is wrong with it.
    pub(super) fn description(path: &Path) -> impl FnOnce(serde_json::Error) -> Self {
        Self::of(format!("{} does not describe a set", path.display()))
    }

    /// Puts the sample to why it cannot be measured.
    pub(super) fn unmeasured(
        sample: &str,
    ) -> impl Fn(relight_core::metrics::MetricError) -> Self + use<'_> {
        move |source| Self::of(format!("{sample} cannot be measured"))(source)
    }
}

impl From<relight_turn::TurnError> for EvalError {
    fn from(fault: relight_turn::TurnError) -> Self {
        Self::Turn(Box::new(fault))
    }
}
