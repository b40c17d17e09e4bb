//! The losses of a step, by name.

use std::collections::BTreeMap;

use tch::Tensor;

use super::losses::Mean;
use crate::error::TrainError;

/// Losses with their coefficients. Their weighted sum is what is descended.
#[derive(Debug, Default)]
pub struct LossTerms(Vec<Term>);

#[derive(Debug)]
struct Term {
    name: &'static str,
    coefficient: f64,
    mean: Option<Mean>,
}

impl LossTerms {
    /// Adds a loss that is a mean over the samples of the batch. Where several processes share a batch, each has as many
    /// of them.
    pub fn add(&mut self, name: &'static str, coefficient: f64, value: Tensor) {
        let over = Tensor::from_slice(&[1.0_f64]);
        self.add_mean(name, coefficient, Mean { value, over });
    }

    /// Adds a loss that is a mean over something else, as over pixels. Several of one name are parts of one loss.
    pub(crate) fn add_mean(&mut self, name: &'static str, coefficient: f64, mean: Mean) {
        let mean = Some(mean);
        self.0.push(Term {
            name,
            coefficient,
            mean,
        });
    }

    /// Notes that the batch has no data for this loss.
    pub(crate) fn add_nothing(&mut self, name: &'static str, coefficient: f64) {
        let mean = None;
        self.0.push(Term {
            name,
            coefficient,
            mean,
        });
    }

    /// Whether there is nothing to descend.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|term| term.mean.is_none())
    }

    /// The weight and value of each loss; 0 and 0 without data.
    ///
    /// # Errors
    /// [`TrainError::Torch`].
    pub(crate) fn means(&self) -> Result<Vec<(f64, f64)>, TrainError> {
        let mean = |term: &Term| {
            term.mean.as_ref().map_or(Ok((0.0, 0.0)), |mean| {
                Ok((f64::try_from(&mean.over)?, f64::try_from(&mean.value)?))
            })
        };
        self.0.iter().map(mean).collect()
    }

    /// The weighted sum, with each loss scaled by its entry of `parts`: 1 for all of it. `None` if there is
    /// nothing.
    pub(crate) fn total(&self, parts: &[f64]) -> Option<Tensor> {
        let mut total: Option<Tensor> = None;
        for (term, part) in self.0.iter().zip(parts) {
            if let Some(mean) = &term.mean {
                let loss = &mean.value * (term.coefficient * part);
                total = Some(match total {
                    Some(total) => &total + &loss,
                    None => loss,
                });
            }
        }
        total
    }

    /// Values in the order of [`Self::means`] by name, each times its coefficient, and their sum as `loss`.
    pub(crate) fn named(&self, values: &[Option<f64>]) -> BTreeMap<String, f64> {
        let mut named = BTreeMap::new();
        for (term, value) in self.0.iter().zip(values) {
            if let Some(value) = value {
                let weighted = term.coefficient * value;
                *named.entry(format!("loss/{}", term.name)).or_default() += weighted;
                *named.entry("loss".to_owned()).or_default() += weighted;
            }
        }
        named
    }
}
