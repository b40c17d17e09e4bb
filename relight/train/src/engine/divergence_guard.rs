//! Stops a run that has gone wrong: losses that are not finite or explode, heads that collapse.

use std::collections::BTreeMap;

use crate::error::TrainError;

/// Steps before losses and heads are judged by their past.
const SETTLING: u64 = 300;
/// A loss this many times its running mean has exploded.
const EXPLOSION: f64 = 50.0;
/// A head that varies less than this part of the ground truth, in the running mean, has collapsed.
const COLLAPSE: f64 = 0.02;
/// Part of the running means that is kept at each step.
const KEEP: f64 = 0.99;

/// Looks at every step.
#[derive(Debug, Default)]
pub(crate) struct DivergenceGuard {
    seen: u64,
    loss: f64,
    spreads: BTreeMap<&'static str, f64>,
}

impl DivergenceGuard {
    /// Looks at the losses and spreads of a step.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub(crate) fn check(
        &mut self,
        step: u64,
        losses: &BTreeMap<String, f64>,
        spreads: &BTreeMap<&'static str, f64>,
    ) -> Result<(), TrainError> {
        let total = losses.get("loss").copied().unwrap_or(0.0);
        let exploded = self.seen >= SETTLING && total > EXPLOSION * self.loss;
        // The sum of all is bad wherever one is: the one itself is named.
        let of_parts = losses.iter().filter(|(name, _)| *name != "loss");
        let mut named = of_parts.chain(losses.get_key_value("loss"));
        if let Some((name, &value)) = named.find(|(_, value)| !value.is_finite()) {
            return Err(bad_loss(step, name, value));
        }
        if exploded {
            return Err(bad_loss(step, "loss", total));
        }
        self.seen += 1;
        self.loss = mean(self.loss, total, self.seen);
        let mut collapsed = None;
        for (&head, &spread) in spreads {
            let running = self.spreads.entry(head).or_insert(spread);
            *running = mean(*running, spread, self.seen);
            if self.seen >= SETTLING && *running < COLLAPSE {
                collapsed = Some((head, *running));
            }
        }
        match collapsed {
            None => Ok(()),
            Some((head, spread)) => Err(TrainError::Refused(format!(
                "the run ends at step {step}: the head {head} has collapsed, with {spread:.2e} of the ground truth's variation"
            ))),
        }
    }
}

fn mean(running: f64, value: f64, seen: u64) -> f64 {
    let keep = KEEP.min(1.0 - 1.0 / seen as f64);
    keep * running + (1.0 - keep) * value
}

fn bad_loss(step: u64, loss: &str, value: f64) -> TrainError {
    let loss = match loss {
        "loss" => "sum of all losses",
        part => part,
    };
    TrainError::Refused(format!(
        "the run ends before step {step}: the {loss} is {value}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(
        guard: &mut DivergenceGuard,
        step: u64,
        loss: f64,
        spread: f64,
    ) -> Result<(), TrainError> {
        let losses = BTreeMap::from([("loss".to_owned(), loss)]);
        let spreads = BTreeMap::from([("albedo", spread)]);
        guard.check(step, &losses, &spreads)
    }

    #[test]
    fn a_run_that_goes_well_goes_on() {
        let mut guard = DivergenceGuard::default();
        for number in 0..2000 {
            step(&mut guard, number, 3.0 / (1.0 + number as f64), 0.8).unwrap();
        }
    }

    #[test]
    fn a_loss_that_is_no_number_ends_it_at_once() {
        let error = step(&mut DivergenceGuard::default(), 4, f64::NAN, 1.0).unwrap_err();
        assert!(error.to_string().contains("step 4"), "{error}");
    }

    #[test]
    fn the_loss_that_is_no_number_is_named() {
        let losses = BTreeMap::from([
            ("loss".to_owned(), f64::NAN),
            ("loss/albedo".to_owned(), 0.2),
            ("loss/normals".to_owned(), f64::NAN),
        ]);
        let error = DivergenceGuard::default().check(7, &losses, &BTreeMap::new());
        let text = error.unwrap_err().to_string();
        assert!(
            text.contains("loss/normals") && text.contains("NaN"),
            "{text}"
        );
    }

    #[test]
    fn a_loss_that_explodes_ends_it() {
        let mut guard = DivergenceGuard::default();
        for number in 0..400 {
            step(&mut guard, number, 1.0, 1.0).unwrap();
        }
        step(&mut guard, 400, 20.0, 1.0).unwrap();
        assert!(step(&mut guard, 401, 1e4, 1.0).is_err());
    }

    #[test]
    fn a_head_that_answers_the_same_for_everything_ends_it() {
        let mut guard = DivergenceGuard::default();
        let ended = (0..3000).find(|&number| step(&mut guard, number, 1.0, 1e-4).is_err());
        assert_eq!(ended, Some(SETTLING - 1));
    }
}
