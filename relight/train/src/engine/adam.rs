//! Adam (Kingma and Ba, 2015), with weight decay apart from the gradient (Loshchilov and Hutter,
//! 2019).
//!
//! libtorch's own optimiser keeps its moments to itself; a run that is to be resumed to the same
//! losses has to save them.

use std::collections::BTreeMap;

use tch::{Kind, Tensor, no_grad};

use super::model::{copy_into, to_weights};
use crate::error::TrainError;
use crate::settings::RunSettings;
use relight_photo::nets::Weights;

/// The number of steps in a saved memory, in thousands and the rest: 32 bits hold both exactly. Skipped steps
/// do not count, so it differs from the step of the run.
const STEPS: &str = "steps";
const STEPS_PART: u64 = 1000;

/// Part of the first moment that is kept at each step.
const BETA1: f64 = 0.9;
/// Gradients with a larger norm are scaled down to it.
const MAX_GRAD_NORM: f64 = 1.0;
/// Keeps the root of the second moment from being zero.
const EPSILON: f64 = 1e-8;

/// The optimiser with its memory.
#[derive(Debug)]
pub struct Adam {
    /// Part of the second moment that is kept at each step.
    beta2: f64,
    weight_decay: f64,
    steps: u64,
    first: BTreeMap<String, Tensor>,
    second: BTreeMap<String, Tensor>,
}

impl Adam {
    /// An optimiser that has made no step.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn new(
        run: &RunSettings,
        parameters: &BTreeMap<String, Tensor>,
    ) -> Result<Self, TrainError> {
        let zeros = || {
            parameters
                .iter()
                .map(|(name, parameter)| Ok((name.clone(), parameter.f_detach()?.f_zeros_like()?)))
                .collect::<Result<BTreeMap<_, _>, TrainError>>()
        };
        Ok(Self {
            beta2: run.beta2,
            weight_decay: run.weight_decay,
            steps: 0,
            first: zeros()?,
            second: zeros()?,
        })
    }

    /// Steps made so far.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Both moments, `first.<name>` and `second.<name>`, and the steps made, [`STEPS`], to be saved.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn memory(&self) -> Result<Weights, TrainError> {
        let first = to_weights(&self.first)?.prefixed("first.");
        let second = to_weights(&self.second)?.prefixed("second.");
        let steps = [self.steps / STEPS_PART, self.steps % STEPS_PART].map(|part| part as f32);
        let steps = relight_photo::nets::Tensor::new(vec![2], steps.to_vec());
        let steps = steps.map(|steps| (STEPS.to_owned(), steps));
        Ok(first.into_iter().chain(second).chain(steps).collect())
    }

    /// Goes on from a memory that was saved.
    ///
    /// # Errors
    /// [`TrainError::Refused`] if it is another network's.
    pub fn load_state(&mut self, memory: &Weights) -> Result<(), TrainError> {
        copy_into(&mut self.first, &memory.under("first."))?;
        copy_into(&mut self.second, &memory.under("second."))?;
        let steps = memory.get(STEPS).map(relight_photo::nets::Tensor::values);
        let Some(&[thousands, rest]) = steps else {
            return Err(TrainError::no_memory(STEPS));
        };
        self.steps = thousands as u64 * STEPS_PART + rest as u64;
        Ok(())
    }

    /// One step along the gradients of the parameters, which are forgotten then. Where their norm is larger than
    /// 1, they are scaled down to it first. Answers the norm that they had.
    ///
    /// # Errors
    /// [`TrainError::Refused`] if the norm is not finite: nothing is changed. [`TrainError::Torch`].
    pub fn step(
        &mut self,
        parameters: &BTreeMap<String, Tensor>,
        learning_rate: f64,
    ) -> Result<f64, TrainError> {
        no_grad(|| self.step_without_gradient(parameters, learning_rate))
    }

    fn step_without_gradient(
        &mut self,
        parameters: &BTreeMap<String, Tensor>,
        learning_rate: f64,
    ) -> Result<f64, TrainError> {
        let norm = gradient_norm(parameters)?;
        if !norm.is_finite() {
            return Err(TrainError::Refused(format!(
                "the run ends: the norm of its gradient is {norm}"
            )));
        }
        let shrink = if norm > MAX_GRAD_NORM {
            MAX_GRAD_NORM / norm
        } else {
            1.0
        };
        self.steps += 1;
        let (beta2, weight_decay) = (self.beta2, self.weight_decay);
        let steps = self.steps.min(i32::MAX as u64) as i32;
        let (bias1, bias2) = (1.0 - BETA1.powi(steps), 1.0 - beta2.powi(steps));
        for (name, parameter) in parameters {
            let mut gradient = parameter.f_grad()?;
            let (Some(first), Some(second)) = (self.first.get_mut(name), self.second.get_mut(name))
            else {
                return Err(TrainError::no_memory(name));
            };
            if !gradient.defined() {
                continue;
            }
            let _ = gradient.f_mul_scalar_(shrink)?;
            let _ = first.f_lerp_(&gradient, 1.0 - BETA1)?;
            let _ = second.f_lerp_(&gradient.f_square()?, 1.0 - beta2)?;
            // first / bias1 over (sqrt(second / bias2) + epsilon), with one division.
            let mut change = second.f_sqrt()?;
            let _ = change.f_add_scalar_(EPSILON * bias2.sqrt())?;
            let _ = change.f_reciprocal_()?.f_mul_(first)?;
            let _ = change.f_mul_scalar_(-learning_rate * bias2.sqrt() / bias1)?;
            let mut parameter = parameter.shallow_clone();
            let _ = parameter
                .f_mul_scalar_(1.0 - learning_rate * weight_decay)?
                .f_add_(&change)?;
            let _ = gradient.f_zero_()?;
        }
        Ok(norm)
    }
}

/// The norm of all gradients together.
fn gradient_norm(parameters: &BTreeMap<String, Tensor>) -> Result<f64, TrainError> {
    let mut norms = Vec::with_capacity(parameters.len());
    for parameter in parameters.values() {
        let gradient = parameter.f_grad()?;
        if gradient.defined() {
            norms.push(gradient.f_norm()?);
        }
    }
    if norms.is_empty() {
        return Ok(0.0);
    }
    // One number at a time would keep a GPU waiting for each.
    let norms = Tensor::f_stack(&norms, 0)?.f_to_kind(Kind::Double)?;
    let square: f64 = Vec::<f64>::try_from(norms)?
        .iter()
        .map(|norm| norm.powi(2))
        .sum();
    Ok(square.sqrt())
}
