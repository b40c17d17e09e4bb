//! All-reduced losses: those of a step over all processes, as if one of them had the whole batch.
//!
//! Each loss is a mean over what its process has of the batch, be it samples or pixels. The mean over all of it
//! is theirs, weighted by how much each has. The gradient of what [`AllReducedLosses::part`] answers, summed over the
//! processes, is that of the all-reduced loss.

use std::collections::BTreeMap;

use tch::Tensor;

use super::task::StepLosses;
use crate::distributed::process_group::ProcessGroup;
use crate::error::TrainError;

/// The losses of a step, the same in every process.
#[derive(Debug)]
pub(crate) struct AllReducedLosses {
    /// By name, with their coefficients; the sum of all is `loss`. Empty where no process has anything to learn from.
    pub(crate) values: BTreeMap<String, f64>,
    /// Whether one of several processes was asked to stop.
    pub(crate) stop: bool,
    /// Which part of each loss is this process's.
    parts: Vec<f64>,
}

impl AllReducedLosses {
    /// Those of all processes of a group, or of one alone.
    ///
    /// # Errors
    /// [`TrainError::Torch`], [`TrainError::ProcessLost`].
    pub(crate) fn new(
        losses: &StepLosses,
        stop: bool,
        group: Option<&ProcessGroup>,
    ) -> Result<Self, TrainError> {
        let means = losses.terms.means()?;
        let mut sums: Vec<f64> = means.iter().map(|(over, _)| *over).collect();
        sums.extend(means.iter().map(|(over, value)| over * value));
        sums.push(f64::from(u8::from(stop)));
        if let Some(group) = group {
            group.sum(&mut sums)?;
        }
        let (overs, rest) = sums.split_at(means.len());
        let (products, rest) = rest.split_at(means.len());
        let reduced = |(over, product): (&f64, &f64)| (*over > 0.0).then(|| product / over);
        let values: Vec<_> = overs.iter().zip(products).map(reduced).collect();
        let part = |((own, _), all): (&(f64, f64), &f64)| if *all > 0.0 { own / all } else { 0.0 };
        Ok(Self {
            values: losses.terms.named(&values),
            stop: rest.last().is_some_and(|stop| *stop > 0.0),
            parts: means.iter().zip(overs).map(part).collect(),
        })
    }

    /// What this process adds to the all-reduced loss, to be descended; `None` if it has nothing.
    pub(crate) fn part(&self, losses: &StepLosses) -> Option<Tensor> {
        losses.terms.total(&self.parts)
    }
}
