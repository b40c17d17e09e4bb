//! The settings of a run, as a TOML file has them.
//!
//! | file | concern |
//! | --- | --- |
//! | `run` | how long and how fast a network learns: `[run]` |
//! | `data` | views and rooms, turns: `[data]`, `[turns]` |
//! | `paper_phase`, `precision` | the paper's phases; the precision of a run |
//! | `file` | reading TOML, and how the settings of two runs differ |

mod data;
mod file;
mod paper_phase;
mod precision;
mod run;
#[cfg(test)]
mod tests;

use std::fmt::Display;
use std::ops::{Bound, RangeBounds};
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::TrainError;

pub use data::{DataSettings, TurnSettings};
pub(super) use file::first_difference;
pub use file::read_settings;
pub use paper_phase::PaperPhase;
pub use precision::ComputePrecision;
pub use run::RunSettings;

/// The settings of `relight train decompose`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DecomposeSettings {
    /// How long and how fast.
    pub run: RunSettings,
    /// On what.
    pub data: DataSettings,
}

/// The settings of `relight train turn`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TurnNetworkSettings {
    /// How long and how fast.
    pub run: RunSettings,
    /// On what.
    pub data: DataSettings,
}

impl Default for TurnNetworkSettings {
    fn default() -> Self {
        Self {
            run: RunSettings::default(),
            data: DataSettings {
                views: 768,
                first_views: Some(64),
                rays: 144,
                ..DataSettings::default()
            },
        }
    }
}

impl TurnNetworkSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check()?;
        self.data.check_batch(self.run.batch)
    }
}

/// The settings of `relight train spec`, `normal`, `light`, `joint` and `specular`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PaperSettings {
    /// How long and how fast.
    pub run: RunSettings,
    /// On what.
    pub data: DataSettings,
    /// What a step takes from turns.
    pub turns: TurnSettings,
    /// Loss coefficients.
    pub loss: PaperLossCoefficients,
}

/// The loss coefficients of the paper's phases: the table `[loss]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PaperLossCoefficients {
    /// The low-rank loss on turns.
    pub low_rank: f64,
    /// The supervised term: the loss on synthetic samples beside turns; 0: none is composed.
    pub supervised: f64,
}

impl Default for PaperLossCoefficients {
    fn default() -> Self {
        Self {
            low_rank: 1.0,
            supervised: 1.0,
        }
    }
}

impl PaperSettings {
    /// The settings of a phase: what the TOML file does not name has its default, the learning rate that of the phase.
    ///
    /// # Errors
    /// As [`read_settings`].
    pub fn from_phase(phase: PaperPhase, file: Option<&Path>) -> Result<Self, TrainError> {
        let mut settings = Self::default();
        settings.run.learning_rate = phase.default_learning_rate();
        file.map_or(Ok(settings.clone()), |file| {
            file::read_over(&settings, file)
        })
    }

    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check_photographs()?;
        check_coefficients(&[
            ("loss.low_rank", self.loss.low_rank),
            ("loss.supervised", self.loss.supervised),
        ])?;
        self.turns.check()
    }
}

impl DecomposeSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check_photographs()
    }
}

/// Whether loss coefficients are in range, and not all of them 0.
fn check_coefficients(coefficients: &[(&'static str, f64)]) -> Result<(), TrainError> {
    for &(name, coefficient) in coefficients {
        check_coefficient(name, coefficient)?;
    }
    let is_nothing = coefficients
        .iter()
        .all(|&(_, coefficient)| coefficient == 0.0);
    let first = coefficients.first().map_or("[loss]", |(name, _)| name);
    let value = "0, as all others of [loss] are";
    ensure(!is_nothing, first, value, "above 0 for one of them")
}

fn check_coefficient(name: &str, value: f64) -> Result<(), TrainError> {
    ensure(
        value >= 0.0 && value.is_finite(),
        name,
        value,
        "a number from 0",
    )
}

/// Whether the value of a setting is in a range, which has a least value.
fn within<N: PartialOrd + Display>(
    name: &str,
    value: N,
    range: impl RangeBounds<N>,
) -> Result<(), TrainError> {
    let least = match range.start_bound() {
        Bound::Included(least) | Bound::Excluded(least) => least.to_string(),
        Bound::Unbounded => String::new(),
    };
    let allowed = match range.end_bound() {
        Bound::Included(most) => format!("from {least} to {most}"),
        Bound::Excluded(end) => format!("from {least} to below {end}"),
        Bound::Unbounded => format!("at least {least}"),
    };
    ensure(range.contains(&value), name, value, &allowed)
}

/// Whether a number is above 0, and one.
fn positive(name: &str, value: f64) -> Result<(), TrainError> {
    ensure(value > 0.0 && value.is_finite(), name, value, "above 0")
}

/// The error of a setting that is not allowed.
fn ensure(
    is_allowed: bool,
    name: &str,
    value: impl Display,
    allowed: &str,
) -> Result<(), TrainError> {
    let fault = || TrainError::Refused(format!("{name} is {value}: it has to be {allowed}"));
    is_allowed.then_some(()).ok_or_else(fault)
}
