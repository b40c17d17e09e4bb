//! Stops a run that has gone wrong: losses that are not finite or explode.

use std::collections::BTreeMap;

use crate::error::TrainError;

/// Steps before losses are judged by their past.
const SETTLING: u64 = 300;
/// A loss this many times its running mean has exploded.
const EXPLOSION: f64 = 50.0;
/// Part of the running mean that is kept at each step.
const KEEP: f64 = 0.99;

/// Looks at every step.
#[derive(Debug, Default)]
pub(crate) struct DivergenceGuard {
    seen: u64,
    /// The running mean of the loss's size: it may be negative.
    size: f64,
}

impl DivergenceGuard {
    /// Looks at the losses of a step.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub(crate) fn check(
        &mut self,
        step: u64,
        losses: &BTreeMap<String, f64>,
    ) -> Result<(), TrainError> {
        let total = losses.get("loss").copied().unwrap_or(0.0);
        let exploded = self.seen >= SETTLING && total > EXPLOSION * self.size;
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
        let keep = KEEP.min(1.0 - 1.0 / self.seen as f64);
        self.size = keep * self.size + (1.0 - keep) * total.abs();
        Ok(())
    }
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

    fn step(guard: &mut DivergenceGuard, step: u64, loss: f64) -> Result<(), TrainError> {
        guard.check(step, &BTreeMap::from([("loss".to_owned(), loss)]))
    }

    #[test]
    fn a_run_that_goes_well_goes_on() {
        let mut guard = DivergenceGuard::default();
        for number in 0..2000 {
            step(&mut guard, number, 3.0 / (1.0 + number as f64)).unwrap();
        }
    }

    #[test]
    fn a_loss_may_become_negative() {
        let mut guard = DivergenceGuard::default();
        for number in 0..2000 {
            step(&mut guard, number, 0.1 - f64::from(number as u32) / 1e4).unwrap();
        }
    }

    #[test]
    fn a_loss_that_is_no_number_ends_it_at_once() {
        let error = step(&mut DivergenceGuard::default(), 4, f64::NAN).unwrap_err();
        assert!(error.to_string().contains("step 4"), "{error}");
    }

    #[test]
    fn the_loss_that_is_no_number_is_named() {
        let losses = BTreeMap::from([
            ("loss".to_owned(), f64::NAN),
            ("loss/albedo".to_owned(), 0.2),
            ("loss/normals".to_owned(), f64::NAN),
        ]);
        let error = DivergenceGuard::default().check(7, &losses);
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
            step(&mut guard, number, 1.0).unwrap();
        }
        step(&mut guard, 400, 20.0).unwrap();
        assert!(step(&mut guard, 401, 1e4).is_err());
    }
}
