//! The losses of a step, by name.

use tch::Tensor;

use super::error::TrainError;

/// Losses with their weights. Their weighted sum is what is descended.
#[derive(Debug, Default)]
pub struct Terms(Vec<(&'static str, f64, Tensor)>);

impl Terms {
    /// Adds a loss.
    pub fn add(&mut self, name: &'static str, weight: f64, loss: Tensor) {
        self.0.push((name, weight, loss));
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The weighted sum.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn total(&self) -> Result<Tensor, TrainError> {
        let mut total = Tensor::from(0.0_f32);
        for (_, weight, loss) in &self.0 {
            total = total.f_add(&loss.f_mul_scalar(*weight)?)?;
        }
        Ok(total)
    }

    /// The values, each times its weight.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub fn values(&self) -> Result<Vec<(&'static str, f64)>, TrainError> {
        self.0
            .iter()
            .map(|(name, weight, loss)| Ok((*name, weight * f64::try_from(loss)?)))
            .collect()
    }
}
