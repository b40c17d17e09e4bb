//! Errors of training.

use std::io;
use std::path::{Path, PathBuf};

/// Why training could not begin or go on.
#[derive(Debug, thiserror::Error)]
pub enum TrainError {
    /// libtorch refused.
    #[error("libtorch failed")]
    Torch(#[from] tch::TchError),
    /// Weights do not fit, or cannot be read or written.
    #[error(transparent)]
    Weights(#[from] relight_photo::nets::NetError),
    /// Samples could not be made.
    #[error(transparent)]
    Synth(#[from] relight_synth::SynthError),
    /// A data set cannot be opened.
    #[error(transparent)]
    Data(#[from] relight_core::reader::ReadError),
    /// A fault, and what to do: in something given (a setting, an option, a checkpoint or a GPU), or in the
    /// run itself.
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
    /// A run that was asked to stop while its first samples were being composed.
    #[error("the run was asked to stop while its first samples were being composed")]
    Stopped,
    /// Another process of the run has ended, or cannot be reached.
    #[error("another process of this run has ended or can no longer be reached ({0})")]
    ProcessLost(String),
    /// A fault of the program.
    #[error("{0}: this is a fault of the program")]
    Fault(&'static str),
}

impl TrainError {
    /// Puts what could not be done to a file to the reason.
    pub(super) fn io(path: &Path, doing: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io {
            path,
            doing,
            source,
        }
    }

    /// A saved optimiser lacks a tensor, or has one of another shape.
    pub(super) fn no_memory(name: &str) -> Self {
        Self::Refused(format!(
            "the saved optimiser has no {name} of the right shape: it is another network's"
        ))
    }

    /// A file is not a checkpoint of this run.
    pub(super) fn checkpoint(path: &Path, fault: &str) -> Self {
        let path = path.display();
        Self::Refused(format!("{path} is not a checkpoint of this run: {fault}"))
    }
}
