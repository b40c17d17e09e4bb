//! How long and how fast a network learns.

use serde::{Deserialize, Serialize};

use super::{ComputePrecision, positive, within};
use crate::error::TrainError;

// Nobody trains more: these keep a slip of the pen from filling the memory.
const MAX_STEPS: u64 = 1_000_000_000;
const MAX_BATCH: u64 = 4096;
const MAX_MINUTES: f64 = 1e6;

/// How long and how fast a network learns: the table `[run]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunSettings {
    /// The seed of the initial weights and of all draws.
    pub seed: u64,
    /// Steps of the whole run, at least 1.
    pub steps: u64,
    /// Samples of a step, at least 1.
    pub batch: u64,
    /// The largest learning rate, above 0.
    pub learning_rate: f64,
    /// Steps over which the learning rate grows to it.
    pub warmup_steps: u64,
    /// The learning rate at the end, as a part of the largest; it falls along a cosine. 1: it does not fall.
    pub min_lr_ratio: f64,
    /// Part of the second moment that Adam keeps.
    pub beta2: f64,
    /// Part of the parameters that is taken off at each step, times the learning rate.
    pub weight_decay: f64,
    /// Part of the exponential moving average of the weights that is kept at each step.
    pub ema_decay: f64,
    /// In which precision layers are computed.
    pub precision: ComputePrecision,
    /// Steps from one line of losses to the next.
    pub log_every: u64,
    /// Steps from one validation, with its pictures, to the next.
    pub validate_every: u64,
    /// Minutes from one checkpoint to the next.
    pub checkpoint_minutes: f64,
}

impl Default for RunSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            steps: 5000,
            batch: 32,
            learning_rate: 1e-3,
            warmup_steps: 100,
            min_lr_ratio: 0.02,
            beta2: 0.99,
            weight_decay: 1e-3,
            ema_decay: 0.998,
            precision: ComputePrecision::Single,
            log_every: 20,
            validate_every: 250,
            checkpoint_minutes: 5.0,
        }
    }
}

impl RunSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        within("run.steps", self.steps, 1..=MAX_STEPS)?;
        within("run.batch", self.batch, 1..=MAX_BATCH)?;
        positive("run.learning_rate", self.learning_rate)?;
        within("run.min_lr_ratio", self.min_lr_ratio, 0.0..=1.0)?;
        within("run.beta2", self.beta2, 0.0..1.0)?;
        within("run.weight_decay", self.weight_decay, 0.0..1.0)?;
        within("run.ema_decay", self.ema_decay, 0.0..1.0)?;
        within("run.log_every", self.log_every, 1..)?;
        within("run.validate_every", self.validate_every, 1..)?;
        within(
            "run.checkpoint_minutes",
            self.checkpoint_minutes,
            1e-3..=MAX_MINUTES,
        )
    }
}
