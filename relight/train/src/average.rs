//! The exponential moving average (EMA) of a network's parameters, which answers better than the parameters themselves.

use std::collections::BTreeMap;

use tch::{Tensor, no_grad};

use super::error::TrainError;
use super::model::{copy_into, to_weights};
use relight_photo::nets::Weights;

/// An exponential moving average. In the first steps it forgets faster, so that it does not remember the
/// initial weights.
#[derive(Debug)]
pub struct WeightAverage {
    decay: f64,
    values: BTreeMap<String, Tensor>,
}

impl WeightAverage {
    /// The average of parameters that keeps the part `decay` (0..1) of itself at each step.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn new(parameters: &BTreeMap<String, Tensor>, decay: f64) -> Result<Self, TrainError> {
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
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn update(
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
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn weights(&self) -> Result<Weights, TrainError> {
        to_weights(&self.values)
    }

    /// Goes on from an average that was saved.
    ///
    /// # Errors
    /// [`TrainError::Memory`] where it is another network's.
    pub fn recall(&mut self, saved: &Weights) -> Result<(), TrainError> {
        copy_into(&mut self.values, saved)
    }
}
