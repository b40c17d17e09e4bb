//! The settings of a run, as a TOML file has them.
//!
//! | file | concern |
//! | --- | --- |
//! | `run` | how long and how fast a network learns: `[run]` |
//! | `data` | composed samples and turns: `[data]`, `[turns]` |
//! | `transfer` | views and rooms of the network of turns: its `[data]` |
//! | `loss` | loss coefficients: `[loss]` |
//! | `file` | reading TOML, and how the settings of two runs differ |
//! | `renamed` | old names of settings |
//! | `allowed` | settings out of range |

mod allowed;
mod data;
mod file;
mod loss;
mod renamed;
mod run;
#[cfg(test)]
mod tests;
mod transfer;

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::decompose::DecomposeLossCoefficients;
use super::error::TrainError;
use super::paper_phases::PaperPhase;
use file::read_with;
use loss::{check_coefficient, check_coefficients};
use relight_photo::nets::{LIGHT_PARAMETERS, PAINT_PARAMETERS};

pub use data::{DataSettings, TurnSettings};
pub(super) use file::first_difference;
pub use file::{SettingsFile, read_settings};
pub use loss::PaperLossCoefficients;
pub use renamed::RenamedSetting;
pub use run::{PrecisionChoice, RunSettings};
pub use transfer::TransferSettings;

/// A head of the decomposing network that can be trained by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DecomposeHead {
    /// That which tells paint from shadow.
    Paint,
    /// That which tells the light.
    Light,
}

impl DecomposeHead {
    /// How the names of its parameters begin.
    #[must_use]
    pub fn parameters(self) -> &'static str {
        match self {
            Self::Paint => PAINT_PARAMETERS,
            Self::Light => LIGHT_PARAMETERS,
        }
    }
}

/// The settings of `relight train decompose`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DecomposeSettings {
    /// The one head that is trained, where all else stays as the weights have it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub only: Option<DecomposeHead>,
    /// How long and how fast.
    pub run: RunSettings,
    /// On what.
    pub data: DataSettings,
    /// Loss coefficients.
    pub loss: DecomposeLossCoefficients,
}

/// The settings of `relight train turn`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TurnNetworkSettings {
    /// How long and how fast.
    pub run: RunSettings,
    /// On what.
    pub data: TransferSettings,
}

impl TurnNetworkSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check()
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

impl PaperSettings {
    /// The settings of a phase: what the TOML file does not name has its default, the learning rate that of the phase.
    ///
    /// # Errors
    /// As [`read_settings`].
    pub fn of_phase(
        phase: PaperPhase,
        file: Option<&Path>,
    ) -> Result<SettingsFile<Self>, TrainError> {
        let Some(file) = file else {
            let mut settings = Self::default();
            settings.run.learning_rate = phase.default_learning_rate();
            return Ok(settings.into());
        };
        read_with(file, |text| {
            let mut settings: Self = toml::from_str(text)?;
            let table: toml::Table = toml::from_str(text)?;
            let run = table.get("run");
            if run.is_none_or(|run| run.get("learning_rate").is_none()) {
                settings.run.learning_rate = phase.default_learning_rate();
            }
            Ok(settings)
        })
    }

    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check()?;
        check_coefficients(&[
            ("loss.low_rank", self.loss.low_rank),
            ("loss.supervised", self.loss.supervised),
            ("loss.labels", self.loss.labels),
        ])?;
        self.turns.check()
    }
}

impl DecomposeSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check()?;
        let loss = &self.loss;
        check_coefficients(&[
            ("loss.whole", loss.whole),
            ("loss.windows", loss.windows),
            ("loss.gradient", loss.gradient),
            ("loss.normals", loss.normals),
            ("loss.highlight", loss.highlight),
            ("loss.highlight_energy", loss.highlight_energy),
            ("loss.paint", loss.paint),
            ("loss.light", loss.light),
        ])?;
        // A part of others: alone it counts nothing.
        check_coefficient("loss.quotient", loss.quotient)
    }
}
