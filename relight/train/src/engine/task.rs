//! A training task: the networks, the data, the losses of a step, and the figures of a validation.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use tch::Device;

use super::terms::LossTerms;
use super::trainable::Trainable;
use crate::distributed::process_group::ProcessGroup;
use crate::error::TrainError;
use relight_synth::SkippedFile;

/// Where a run is computed, and with how many threads.
#[derive(Debug, Clone)]
pub struct Resources {
    /// Where networks are computed.
    pub device: Device,
    /// Data-loader workers: threads that compose samples.
    pub workers: usize,
    /// Set to end a run early, also while its first samples are being composed.
    pub stop: Arc<AtomicBool>,
}

/// What a run trains.
pub trait TrainingTask {
    /// Its name, as on the command line.
    fn name(&self) -> &'static str;

    /// A text that identifies the inputs, apart from the settings and the trained weights.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    fn inputs(&self) -> Result<String, TrainError>;

    /// Takes this process's part of the work from now on. Called before the first step.
    ///
    /// # Errors
    /// [`TrainError::Refused`] if the settings leave no equal parts.
    fn join(&mut self, group: &ProcessGroup) -> Result<(), TrainError>;

    /// Unused files of the user.
    fn left_out(&self) -> &[SkippedFile] {
        &[]
    }

    /// The network that learns.
    fn trainable(&mut self) -> &mut Trainable;

    /// The losses of a step, from 0, on this process's part of its batch; always the same ones, in the same order. Steps
    /// are asked for one after the other.
    ///
    /// # Errors
    /// Whatever keeps the step from being computed.
    fn step(&mut self, step: u64) -> Result<StepLosses, TrainError>;

    /// Figures of the averaged networks on what they are not trained on.
    ///
    /// # Errors
    /// Whatever keeps them from being computed.
    fn validate(&mut self) -> Result<Validation, TrainError>;

    /// The cursor in data that are read in order, to resume from; empty without such data.
    fn cursor(&self) -> String {
        String::new()
    }

    /// Goes on from such a cursor.
    ///
    /// # Errors
    /// A sentence with the reason.
    fn go_to(&mut self, _place: &str) -> Result<(), String> {
        Ok(())
    }
}

/// What a step gives.
#[derive(Debug, Default)]
pub struct StepLosses {
    /// The losses.
    pub terms: LossTerms,
    /// What was damaged in the data, and is not in the batch.
    pub damage: Option<String>,
}

impl StepLosses {
    /// Adds what was damaged in a part of the data.
    pub(crate) fn add_damage(&mut self, damage: &[String]) {
        if !damage.is_empty() {
            let earlier = self.damage.take();
            let all: Vec<&str> = earlier.iter().chain(damage).map(String::as_str).collect();
            self.damage = Some(all.join("; "));
        }
    }
}

/// What a validation gives.
#[derive(Debug, Default)]
pub struct Validation {
    /// Figures by name.
    pub figures: BTreeMap<String, f64>,
    /// What was damaged in the data, and is not in the figures.
    pub damage: Option<String>,
}
