//! A network that learns: its parameters, its optimiser and the exponential moving average (EMA) of its weights, which
//! answers better than the parameters themselves.

use std::collections::BTreeMap;

use tch::{Device, Tensor, no_grad};

use super::adam::Adam;
use super::model::{Model, copy_into, to_weights};
use crate::error::TrainError;
use crate::settings::RunSettings;
use relight_photo::nets::{Graph, Weights};

/// A network in training.
#[derive(Debug)]
pub struct Trainable {
    name: &'static str,
    /// The network.
    pub model: Model,
    adam: Adam,
    average: WeightAverage,
}

impl Trainable {
    /// A network that begins with these weights, or with random ones, and learns as a run does.
    ///
    /// # Errors
    /// Those of [`Model::new`].
    pub fn new(
        graph: Graph,
        weights: Option<&Weights>,
        run: &RunSettings,
        device: Device,
    ) -> Result<Self, TrainError> {
        let name = graph.name();
        let initial = || Weights::initial(&graph, run.seed);
        let weights = weights.cloned().unwrap_or_else(initial);
        let model = Model::new(graph, &weights, device, run.precision)?;
        Ok(Self {
            name,
            adam: Adam::new(run, model.parameters())?,
            average: WeightAverage::new(model.parameters(), run.ema_decay)?,
            model,
        })
    }

    /// The network's name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// One step along the gradients; their norm before they were scaled down to `max_grad_norm`.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn step(&mut self, learning_rate: f64, max_grad_norm: f64) -> Result<f64, TrainError> {
        let norm = self
            .adam
            .step(self.model.parameters(), learning_rate, max_grad_norm)?;
        self.average
            .update(self.model.parameters(), self.adam.steps())?;
        Ok(norm)
    }

    /// The averaged weights: what is shipped.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn averaged(&self) -> Result<Weights, TrainError> {
        self.average.weights()
    }

    /// The network with its averaged weights, without gradients.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn averaged_model(&self) -> Result<Model, TrainError> {
        let weights = self.averaged()?;
        let mut model = self.model.with_weights(&weights)?;
        model.set_trainable(false)?;
        Ok(model)
    }

    /// All that is needed to go on: `<name>.model.*`, `<name>.average.*`, `<name>.first.*`, `<name>.second.*`,
    /// `<name>.steps`.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn state(&self) -> Result<Weights, TrainError> {
        let (model, average) = (self.model.weights()?, self.averaged()?);
        let memory = self.adam.memory()?;
        let named = |part: &str, weights: &Weights| -> Vec<_> {
            let prefix = format!("{}.{part}", self.name);
            weights
                .iter()
                .map(|(name, tensor)| (format!("{prefix}{name}"), tensor.clone()))
                .collect()
        };
        let mut all = named("model.", &model);
        all.extend(named("average.", &average));
        all.extend(named("", &memory));
        Ok(all.into_iter().collect())
    }

    /// Goes on from a state that was saved.
    ///
    /// # Errors
    /// [`TrainError::Refused`] if it is another network's.
    pub fn load_state(&mut self, state: &Weights) -> Result<(), TrainError> {
        let own = state.under(&format!("{}.", self.name));
        self.model.load_state(&own.under("model."))?;
        self.average.load_state(&own.under("average."))?;
        self.adam.load_state(&own)
    }
}

/// An exponential moving average. In the first steps it forgets faster, so that it does not remember the
/// initial weights.
#[derive(Debug)]
struct WeightAverage {
    decay: f64,
    values: BTreeMap<String, Tensor>,
}

impl WeightAverage {
    /// The average of parameters that keeps the part `decay` (0..1) of itself at each step.
    fn new(parameters: &BTreeMap<String, Tensor>, decay: f64) -> Result<Self, TrainError> {
        let copy = |(name, parameter): (&String, &Tensor)| {
            let mut value = parameter.f_detach()?.f_zeros_like()?;
            value.f_copy_(&parameter.f_detach()?)?;
            Ok((name.clone(), value))
        };
        Ok(Self {
            decay,
            values: parameters
                .iter()
                .map(copy)
                .collect::<Result<_, tch::TchError>>()?,
        })
    }

    /// Takes up the parameters after the step of a number, from 1.
    fn update(
        &mut self,
        parameters: &BTreeMap<String, Tensor>,
        step: u64,
    ) -> Result<(), TrainError> {
        let step = step as f64;
        let decay = self.decay.min((1.0 + step) / (10.0 + step));
        no_grad(|| {
            for (name, value) in &mut self.values {
                if let Some(parameter) = parameters.get(name) {
                    let _ = value.f_lerp_(parameter, 1.0 - decay)?;
                }
            }
            Ok(())
        })
    }

    /// The averaged weights.
    fn weights(&self) -> Result<Weights, TrainError> {
        to_weights(&self.values)
    }

    /// Goes on from an average that was saved.
    fn load_state(&mut self, saved: &Weights) -> Result<(), TrainError> {
        copy_into(&mut self.values, saved)
    }
}
