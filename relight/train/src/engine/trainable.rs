//! A network that learns: its parameters, its optimiser and the exponential moving average (EMA) of its weights, which
//! answers better than the parameters themselves.

use tch::Device;

use super::adam::Adam;
use super::model::Model;
use crate::error::TrainError;
use crate::settings::RunSettings;
use relight_photo::nets::{Graph, Weights};

/// A network in training.
#[derive(Debug)]
pub struct Trainable {
    /// The network.
    pub model: Model,
    adam: Adam,
    /// The network with averaged weights, without gradients.
    average: Model,
    ema_decay: f64,
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
        let initial = || Weights::initial(&graph, run.seed);
        let weights = weights.cloned().unwrap_or_else(initial);
        let model = Model::new(graph.clone(), &weights, device, run.precision)?;
        let mut average = Model::new(graph, &weights, device, run.precision)?;
        average.set_trainable(false)?;
        Ok(Self {
            adam: Adam::new(run, model.parameters())?,
            model,
            average,
            ema_decay: run.ema_decay,
        })
    }

    /// The network's name.
    pub fn name(&self) -> &'static str {
        self.model.graph().name()
    }

    /// One step along the gradients; their norm before they were scaled down to 1.
    ///
    /// # Errors
    /// As of [`Adam::step`].
    pub fn step(&mut self, learning_rate: f64) -> Result<f64, TrainError> {
        let norm = self.adam.step(self.model.parameters(), learning_rate)?;
        // In the first steps it forgets faster, so that it does not remember the initial weights.
        let step = self.adam.steps() as f64;
        let decay = self.ema_decay.min((1.0 + step) / (10.0 + step));
        self.average.approach(&self.model, 1.0 - decay)?;
        Ok(norm)
    }

    /// The network with its averaged weights, which are shipped; without gradients.
    pub fn average(&self) -> &Model {
        &self.average
    }

    /// All that is needed to go on: `<name>.model.*`, `<name>.average.*`, `<name>.first.*`, `<name>.second.*`,
    /// `<name>.steps`.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn state(&self) -> Result<Weights, TrainError> {
        let model = self.model.weights()?.prefixed("model.");
        let average = self.average.weights()?.prefixed("average.");
        let all = model.into_iter().chain(average).chain(self.adam.memory()?);
        Ok(all
            .collect::<Weights>()
            .prefixed(&format!("{}.", self.name())))
    }

    /// Goes on from a state that was saved.
    ///
    /// # Errors
    /// [`TrainError::Refused`] if it is another network's.
    pub fn load_state(&mut self, state: &Weights) -> Result<(), TrainError> {
        let own = state.under(&format!("{}.", self.name()));
        self.model.load_state(&own.under("model."))?;
        self.average.load_state(&own.under("average."))?;
        self.adam.load_state(&own)
    }
}
