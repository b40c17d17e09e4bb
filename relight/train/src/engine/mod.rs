//! A run: steps of an optimiser, mixed precision, checkpoints, the log of metrics, and what ends a run that diverges. Knows no
//! task: a [`task::TrainingTask`] says what is trained.

pub(crate) mod adam;
pub(crate) mod all_reduced;
pub(crate) mod checkpoint;
pub(crate) mod cuda;
pub(crate) mod divergence_guard;
mod guard;
pub(crate) mod learning_rate;
pub(crate) mod losses;
pub(crate) mod memory;
pub(crate) mod metrics_log;
pub(crate) mod model;
pub(crate) mod run;
pub(crate) mod task;
pub(crate) mod tensors;
pub(crate) mod terms;
pub(crate) mod trainable;
