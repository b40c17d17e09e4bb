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
    /// libtorch's library for CUDA is missing, or lacks another.
    #[error(
        "libtorch's library for CUDA cannot be loaded: PyTorch for CUDA is needed with all its packages, its folder torch as \
         LIBTORCH where relight is built, or torch/lib in LD_LIBRARY_PATH where it runs"
    )]
    NoCuda(#[source] libloading::Error),
    /// A GPU that is not there.
    #[error("there is no GPU {number}, counted from 0: libtorch finds {count} here")]
    NoGpu {
        /// The number that was asked for, from 0.
        number: usize,
        /// How many there are.
        count: i64,
    },
    /// Data-loader workers could not be started.
    #[error("the data-loader workers could not be started")]
    Threads(#[source] io::Error),
    /// Composing samples panicked.
    #[error("a sample could not be composed: this is a fault of the program")]
    DataLoader,
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
    /// Turns to judge a network by that the phase has no figures for.
    #[error("relight train {phase} has no figures on turns: leave --held-out away")]
    NotJudged {
        /// The phase.
        phase: &'static str,
    },
    /// Labels for a phase that learns nothing from them.
    #[error("relight train {phase} learns nothing from labels: leave --labels away")]
    NotLabelled {
        /// The phase.
        phase: &'static str,
    },
    /// Turns for a phase that learns nothing from them.
    #[error(
        "relight train {phase} learns from composed samples, not from turns: leave --turns away"
    )]
    NotTaught {
        /// The phase.
        phase: &'static str,
    },
    /// The first of the labels cannot be read.
    #[error("the first of the labels")]
    Label(#[source] relight_core::reader::DamagedSample),
    /// Labels of a size that the networks do not take.
    #[error(
        "the labels have {width} x {height} pixels, and both have to be multiples of 32: extract the turns with another --size"
    )]
    LabelSize {
        /// Their width.
        width: usize,
        /// Their height.
        height: usize,
    },
    /// An environment in which a variable is missing that a launcher sets.
    #[error(
        "{set} is set and {missing} is not: to train with several processes, set RANK, WORLD_SIZE, MASTER_ADDR and MASTER_PORT for each of \
         them, as torchrun does; for one process, unset RANK and WORLD_SIZE"
    )]
    LaunchIncomplete {
        /// One that is set.
        set: &'static str,
        /// The one that is missing.
        missing: &'static str,
    },
    /// A variable of the launcher that has a wrong value.
    #[error("the environment variable {name} is {value}: it has to be {allowed}")]
    LaunchValue {
        /// Its name.
        name: &'static str,
        /// Its value.
        value: String,
        /// What can be.
        allowed: String,
    },
    /// The other processes of a run were not met.
    #[error(
        "process {process} of {of} did not meet the others at {address}:{port} (MASTER_ADDR, MASTER_PORT): {fault}"
    )]
    NotJoined {
        /// This process.
        process: u32,
        /// How many there are.
        of: u32,
        /// Where they meet.
        address: String,
        /// Where they meet.
        port: u16,
        /// c10d's own words.
        fault: String,
    },
    /// Processes that do not train the same thing.
    #[error(
        "{what} of process {process} are not those of process 0: start all processes with the same program, command and files, \
         and a folder for the run that all of them see"
    )]
    Disagreement {
        /// The first process that differs.
        process: u32,
        /// In what.
        what: &'static str,
    },
    /// A number that cannot be divided among the processes.
    #[error("{name} is {value}: {of} processes need {needed}")]
    Indivisible {
        /// Its name in the file of settings.
        name: &'static str,
        /// Its value.
        value: u64,
        /// How many processes there are.
        of: u32,
        /// What it would have to be.
        needed: String,
    },
    /// Another process of the run has ended, or cannot be reached.
    #[error("another process of this run has ended or cannot be reached any more ({fault})")]
    ProcessLost {
        /// c10d's own words.
        fault: String,
    },
    /// A run that ended because another of its processes did.
    #[error("{lost}; the run ends after {step} steps, and {saved}")]
    EndedEarly {
        /// What happened.
        lost: Box<TrainError>,
        /// Steps made.
        step: u64,
        /// What became of the checkpoint.
        saved: String,
    },
    /// A loss that is not a number, or has grown out of all proportion.
    #[error("at step {step} the {loss} is {value}: the run ends before this step is made; {batch}")]
    BadLoss {
        /// The step.
        step: u64,
        /// Which loss.
        loss: String,
        /// Its value.
        value: f64,
        /// Where the batch was saved, or why it was not.
        batch: String,
    },
    /// A head that answers the same for every pixel of every picture.
    #[error(
        "at step {step} the answers for {head} have hardly any variation left ({spread:.2e} of the ground truth's): the head has collapsed, and the run \
         ends; {batch}"
    )]
    Collapsed {
        /// The step.
        step: u64,
        /// Which head.
        head: &'static str,
        /// Standard deviation of the answers over that of the ground truth.
        spread: f64,
        /// Where the batch was saved, or why it was not.
        batch: String,
    },
}
