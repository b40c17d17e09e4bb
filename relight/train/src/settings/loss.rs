//! Loss coefficients.

use serde::{Deserialize, Serialize};

use crate::error::TrainError;
use crate::low_rank::LowRankForm;

/// The loss coefficients of the paper's phases: the table `[loss]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PaperLossCoefficients {
    /// The loss on turns.
    pub low_rank: f64,
    /// The supervised term: the loss on composed samples beside turns; 0: none is composed.
    pub supervised: f64,
    /// Which low-rank loss.
    pub form: LowRankForm,
}

impl Default for PaperLossCoefficients {
    fn default() -> Self {
        Self {
            low_rank: 1.0,
            supervised: 1.0,
            form: LowRankForm::Squared,
        }
    }
}

/// Whether loss coefficients are in range, and not all of them 0.
pub(super) fn check_coefficients(coefficients: &[(&'static str, f64)]) -> Result<(), TrainError> {
    for &(name, coefficient) in coefficients {
        check_coefficient(name, coefficient)?;
    }
    match coefficients {
        [(name, _), ..]
            if coefficients
                .iter()
                .all(|&(_, coefficient)| coefficient == 0.0) =>
        {
            Err(TrainError::Setting {
                name,
                value: "0, as all others of [loss] are".to_owned(),
                allowed: "above 0 for one of them",
            })
        }
        _ => Ok(()),
    }
}

pub(super) fn check_coefficient(name: &'static str, coefficient: f64) -> Result<(), TrainError> {
    if coefficient >= 0.0 && coefficient.is_finite() {
        return Ok(());
    }
    Err(TrainError::Setting {
        name,
        value: coefficient.to_string(),
        allowed: "a number from 0",
    })
}
