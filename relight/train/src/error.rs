//! What can go wrong while training.

use std::io;
use std::path::PathBuf;

/// Why training could not begin or go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// libtorch refused.
    #[error("libtorch failed")]
    Torch(#[from] tch::TchError),
    /// Weights do not fit, or cannot be read or written.
    #[error(transparent)]
    Weights(#[from] relight_photo::nets::NetError),
    /// An optimiser's memory that is another network's.
    #[error("the saved optimiser has no {0} of the right shape: it is another network's")]
    Memory(String),
    /// Samples could not be made.
    #[error(transparent)]
    Synth(#[from] relight_synth::SynthError),
    /// A data set cannot be opened.
    #[error(transparent)]
    Data(#[from] relight_core::reader::OpenError),
    /// A sheet of answers could not be encoded.
    #[error(transparent)]
    Encode(#[from] relit_data::shard::ShardError),
    /// Something that was given cannot be used: a setting, an option, a launcher's variable, a GPU.
    #[error("{0}")]
    Refused(String),
    /// A file cannot be read or written.
    #[error("{path} cannot be {doing}")]
    Io {
        /// The file.
        path: PathBuf,
        /// `read` or `written`.
        doing: &'static str,
        /// Why.
        source: io::Error,
    },
    /// A checkpoint that is none, or another run's.
    #[error("{path} is no checkpoint of this run: {fault}")]
    Checkpoint {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        fault: String,
    },
    /// A folder that holds a run already.
    #[error("{path} holds a run already: go on with --resume, or give another folder")]
    Occupied {
        /// The folder.
        path: PathBuf,
    },
    /// A folder whose run goes on in another program.
    #[error(
        "the run in {path} is being made by another program: wait for its end, or give another folder"
    )]
    Running {
        /// The folder.
        path: PathBuf,
    },
    /// A run that was asked to stop while its first samples were being composed.
    #[error("the run was asked to stop while its first samples were being composed")]
    Stopped,
    /// Another process of the run has ended, or cannot be reached.
    #[error("another process of this run has ended or cannot be reached any more ({0})")]
    ProcessLost(String),
    /// A run that has gone wrong, or that another process leaves unfinished.
    #[error("{0}")]
    Ended(String),
    /// A fault of the program.
    #[error("{0}: this is a fault of the program")]
    Fault(&'static str),
}
