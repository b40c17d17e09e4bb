//! One file a verb: its arguments and its `run`.

pub(super) mod decompose;
pub(super) mod eval;
pub(super) mod insert;
pub(super) mod relight;
pub(super) mod render;
pub(super) mod synth;
#[cfg(feature = "train")]
pub(super) mod train;
pub(super) mod turn;
pub(super) mod weights;
