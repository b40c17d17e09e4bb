//! What can go wrong while training.

use std::io;
use std::path::PathBuf;

use crate::{data, nets, synth};

/// Why training could not begin or go on.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TrainError {
    /// libtorch refused.
    #[error("libtorch failed")]
    Torch(#[from] tch::TchError),
    /// Weights do not fit, or cannot be read or written.
    #[error(transparent)]
    Weights(#[from] nets::NetError),
    /// An optimiser's memory that is another network's.
    #[error("the saved optimiser has no {0} of the right shape: it is another network's")]
    Memory(String),
    /// Samples could not be made.
    #[error(transparent)]
    Synth(#[from] synth::SynthError),
    /// A data set cannot be opened.
    #[error(transparent)]
    Data(#[from] data::OpenError),
    /// A data set without two frames of one turn that can be read.
    #[error("the turns have no batch of two frames that can be read")]
    NoFrames,
    /// A phase lacks a data set or a network.
    #[error("relight train {phase} needs {option}")]
    Needed {
        /// The phase.
        phase: &'static str,
        /// The option that gives it.
        option: &'static str,
    },
    /// Threads could not be started.
    #[error("threads that compose samples could not be started")]
    Threads(#[source] io::Error),
    /// The threads that compose samples have ended.
    #[error("the threads that compose samples have ended: this is a fault of the program")]
    Composer,
    /// A sheet of answers could not be laid out.
    #[error("a sheet of answers could not be laid out: this is a fault of the program")]
    Sheet,
    /// A sheet of answers could not be encoded.
    #[error(transparent)]
    Encode(#[from] relit_data::shard::ShardError),
    /// Settings that cannot be read.
    #[error("{path} is no file of settings: {fault}")]
    Settings {
        /// The file.
        path: PathBuf,
        /// What is wrong, and where.
        fault: String,
    },
    /// A setting that cannot be.
    #[error("{name} is {value}: it has to be {allowed}")]
    Setting {
        /// Its name in the file.
        name: &'static str,
        /// What was given.
        value: String,
        /// What can be.
        allowed: &'static str,
    },
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
    /// A loss that is not a number, or has grown out of all proportion.
    #[error(
        "at step {step} the loss {loss} is {value}: the run ends before this step is made; the batch is in {batch}"
    )]
    BadLoss {
        /// The step.
        step: u64,
        /// Which loss.
        loss: String,
        /// Its value.
        value: f64,
        /// Where the batch was saved.
        batch: PathBuf,
    },
    /// A head that answers the same for every pixel of every picture.
    #[error(
        "at step {step} the answers for {head} have hardly any variation left ({spread:.2e} of the truth's): the head has collapsed, and the run \
         ends; the batch is in {batch}"
    )]
    Collapsed {
        /// The step.
        step: u64,
        /// Which head.
        head: &'static str,
        /// Standard deviation of the answers over that of the truth.
        spread: f64,
        /// Where the batch was saved.
        batch: PathBuf,
    },
}
