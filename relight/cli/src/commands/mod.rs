//! One file a verb: its arguments and its `run`.

use std::error::Error;

use relit_console::Outcome;

pub(super) mod decompose;
pub(super) mod eval;
pub(super) mod export;
pub(super) mod insert;
pub(super) mod relight;
pub(super) mod render;
pub(super) mod serve;
pub(super) mod synth;
#[cfg_attr(not(feature = "train"), path = "without_training.rs")]
pub(super) mod train;
pub(super) mod turn;
pub(super) mod weights;

/// What a verb returns: an outcome, or the error that ends the program with exit code 1.
pub(super) type CommandResult = Result<Outcome, Box<dyn Error>>;
