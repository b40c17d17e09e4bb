//! Why an evaluation cannot be made.

use std::path::PathBuf;

use relight_core::image::{Extent, ImageError};
use relight_core::light::LightError;
use relight_core::metrics::MetricError;
use relight_core::parallel::JobPanic;
use relight_photo::insert::InsertError;
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
    /// Measuring a sample panicked.
    #[error("{sample}")]
    Panic {
        /// The sample.
        sample: String,
        /// The panic.
        #[source]
        panic: JobPanic,
    },
    /// The ground truth does not have a part that the protocol needs.
    #[error("the ground truth has no {part} of {sample}: this protocol cannot be run on it")]
    Lacks {
        /// The sample.
        sample: String,
        /// The part.
        part: &'static str,
    },
    /// There is no prediction.
    #[error(
        "there is no prediction {part}.exr or {part}.png in {}: all images of the ground truth are compared, or none",
        folder.display()
    )]
    Unpredicted {
        /// The folder in which it should be.
        folder: PathBuf,
        /// Which part.
        part: &'static str,
    },
    /// A prediction cannot be read.
    #[error("a prediction cannot be read")]
    Prediction(#[from] ImageError),
    /// A prediction does not have the size of the ground truth.
    #[error("{} has {}x{} pixels, its ground truth {}x{}", path.display(), found.width, found.height, expected.width, expected.height)]
    Size {
        /// The prediction.
        path: PathBuf,
        /// Its size.
        found: Extent,
        /// The ground truth's.
        expected: Extent,
    },
    /// A folder holds no turns.
    #[error("{} holds no turns of relight synth --turn", path.display())]
    Turns {
        /// The folder.
        path: PathBuf,
        /// Why not.
        source: Box<relit_data::shard::ShardError>,
    },
    /// A turn cannot be solved.
    #[error("a turn cannot be solved")]
    Turn(#[source] Box<relight_turn::TurnError>),
    /// A network cannot be run.
    #[error(transparent)]
    Network(#[from] relight_nets::NetError),
    /// A file cannot be read.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// A file or folder cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The operating system's reason.
        source: std::io::Error,
    },
    /// The description of a set does not parse.
    #[error("{} does not describe a set", path.display())]
    Description {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: serde_json::Error,
    },
    /// A folder says that its files are encoded otherwise than the caller does.
    #[error(
        "{} says that its files are {written}, and --transfer that they are {said}: leave --transfer out",
        path.display()
    )]
    Encoding {
        /// The description.
        path: PathBuf,
        /// What it says.
        written: &'static str,
        /// What the caller says.
        said: &'static str,
    },
    /// The description is of another version.
    #[error("{} says {found:?}, this version reads {expected:?}", path.display())]
    Schema {
        /// The file.
        path: PathBuf,
        /// What it says.
        found: String,
        /// What it should say.
        expected: &'static str,
    },
    /// A folder holds a set of another recipe.
    #[error(
        "{} holds objects that were made with other settings: give the same ones, or another folder",
        path.display()
    )]
    OtherSettings {
        /// The folder.
        path: PathBuf,
    },
    /// Objects cannot be made.
    #[error(transparent)]
    Synth(#[from] relight_synth::SynthError),
    /// Light is not in the form of coefficients.
    #[error("{} does not hold light", path.display())]
    Light {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: LightError,
    },
    /// No light can be fitted.
    #[error("no light can be fitted to {sample}")]
    Unlit {
        /// The sample.
        sample: String,
        /// Why.
        source: LightError,
    },
    /// An object cannot be decomposed, relit or inserted.
    #[error("{sample} cannot be decomposed or shown in other light")]
    Insertion {
        /// The sample.
        sample: String,
        /// Why.
        source: Box<InsertError>,
    },
    /// A measure cannot be taken.
    #[error("{sample} cannot be measured")]
    Metric {
        /// The sample.
        sample: String,
        /// Why.
        source: MetricError,
    },
}

impl EvalError {
    /// Puts the path to an operating system's reason.
    pub(super) fn write(path: &std::path::Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write { path, source }
    }
}

impl From<relight_turn::TurnError> for EvalError {
    fn from(fault: relight_turn::TurnError) -> Self {
        Self::Turn(Box::new(fault))
    }
}
