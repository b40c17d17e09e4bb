//! The settings of a run, as a TOML file has them.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::adam::AdamSettings;
use super::decompose::DecomposeWeights;
use super::error::TrainError;
use super::low_rank::LowRankForm;
use crate::synth::LightKind;

/// How long and how fast a network learns: the table `[run]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RunSettings {
    /// Of the initial weights and of all draws.
    pub seed: u64,
    /// Steps in all, at least 1.
    pub steps: u64,
    /// Samples of a step, at least 1.
    pub batch: u64,
    /// The largest learning rate, above 0.
    pub rate: f64,
    /// Steps over which the rate grows to it.
    pub warm_up: u64,
    /// Part of the rate that is left at the end; it falls along a cosine. 1: it does not fall.
    pub final_share: f64,
    /// Gradients longer than this are shortened to it.
    pub longest_gradient: f64,
    /// Part of the first moment that Adam keeps.
    pub beta1: f64,
    /// Part of the second moment that Adam keeps.
    pub beta2: f64,
    /// Part of the parameters that is taken off at each step, times the rate.
    pub decay: f64,
    /// Part of the averaged weights that is kept at each step.
    pub average: f64,
    /// In which precision layers are computed.
    pub precision: PrecisionChoice,
    /// Steps from one line of losses to the next.
    pub log_every: u64,
    /// Steps from one validation, with its pictures, to the next.
    pub validate_every: u64,
    /// Minutes from one checkpoint to the next.
    pub checkpoint_minutes: f64,
}

/// In which precision layers are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PrecisionChoice {
    /// 32 bits.
    Single,
    /// bfloat16.
    Mixed,
    /// 64 bits, several times slower: to compare runs. Checkpoints keep 32 of them.
    Double,
    /// The faster of single and mixed, by a short measurement when the run begins; a resumed run measures again.
    Fastest,
}

impl Default for RunSettings {
    fn default() -> Self {
        Self {
            seed: 1,
            steps: 5000,
            batch: 32,
            rate: 1e-3,
            warm_up: 100,
            final_share: 0.02,
            longest_gradient: 1.0,
            beta1: 0.9,
            beta2: 0.99,
            decay: 1e-3,
            average: 0.998,
            precision: PrecisionChoice::Fastest,
            log_every: 20,
            validate_every: 250,
            checkpoint_minutes: 5.0,
        }
    }
}

/// What samples are composed of: the table `[data]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DataSettings {
    /// Width and height of the pictures, a multiple of 32.
    pub size: u32,
    /// Views of each object.
    pub views: u32,
    /// Materials and lightings of each view.
    pub lightings: u32,
    /// What light there is.
    pub light: LightKind,
    /// Whether objects block light.
    pub shadows: bool,
    /// Part of the pictures that a plain camera takes.
    pub plain_share: f64,
    /// Samples that are kept to draw from.
    pub window: u64,
    /// How often each is seen, in the mean.
    pub reuse: f64,
    /// A folder of meshes beside the shapes that are made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meshes: Option<PathBuf>,
    /// A folder of pictures to lay onto objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub textures: Option<PathBuf>,
    /// A folder of panoramas in place of those that are made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub panoramas: Option<PathBuf>,
    /// Samples on which the network is validated, made from seeds that it does not train on.
    pub validation: u64,
}

impl Default for DataSettings {
    fn default() -> Self {
        Self {
            size: 128,
            views: 2,
            lightings: 6,
            light: LightKind::Mixed,
            shadows: true,
            plain_share: 0.5,
            window: 768,
            reuse: 4.0,
            meshes: None,
            textures: None,
            panoramas: None,
            validation: 48,
        }
    }
}

/// The settings of `relight train decompose`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DecomposeSettings {
    /// How long and how fast.
    pub run: RunSettings,
    /// On what.
    pub data: DataSettings,
    /// What each loss counts.
    pub loss: DecomposeWeights,
}

/// What each loss of the paper's phases counts: the table `[loss]`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct PaperLosses {
    /// The loss on turns.
    pub low_rank: f64,
    /// The loss on composed samples beside turns; 0: none is composed.
    pub anchor: f64,
    /// Which low-rank loss.
    pub form: LowRankForm,
}

impl Default for PaperLosses {
    fn default() -> Self {
        Self {
            low_rank: 1.0,
            anchor: 1.0,
            form: LowRankForm::Squared,
        }
    }
}

/// What a step takes from turns: the table `[turns]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TurnSettings {
    /// Groups of a step, at least 1, each of 12 frames of one turn.
    pub groups: u64,
}

impl Default for TurnSettings {
    fn default() -> Self {
        Self { groups: 1 }
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
    /// What each loss counts.
    pub loss: PaperLosses,
}

impl PaperSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check()?;
        if self.turns.groups == 0 {
            return Err(TrainError::Setting {
                name: "turns.groups",
                value: "0".to_owned(),
                allowed: "at least 1",
            });
        }
        Ok(())
    }
}

impl DecomposeSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check()
    }
}

/// Reads settings from a TOML file; what it does not name has its default, and a name that is none is an
/// error.
///
/// # Errors
/// [`TrainError::Io`] or [`TrainError::Settings`].
pub fn read_settings<S: DeserializeOwned>(path: &Path) -> Result<S, TrainError> {
    let text = fs::read_to_string(path).map_err(|source| TrainError::Io {
        path: path.to_owned(),
        doing: "read",
        source,
    })?;
    toml::from_str(&text).map_err(|error| TrainError::Settings {
        path: path.to_owned(),
        fault: error.to_string(),
    })
}

impl RunSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let part = |value: f64| (0.0..1.0).contains(&value);
        let positive = |value: f64| value > 0.0 && value.is_finite();
        for (name, is_right, value, allowed) in [
            (
                "run.steps",
                self.steps > 0,
                self.steps.to_string(),
                "at least 1",
            ),
            (
                "run.batch",
                self.batch > 0,
                self.batch.to_string(),
                "at least 1",
            ),
            (
                "run.rate",
                positive(self.rate),
                self.rate.to_string(),
                "above 0",
            ),
            (
                "run.final_share",
                (0.0..=1.0).contains(&self.final_share),
                self.final_share.to_string(),
                "from 0 to 1",
            ),
            (
                "run.longest_gradient",
                positive(self.longest_gradient),
                self.longest_gradient.to_string(),
                "above 0",
            ),
            (
                "run.beta1",
                part(self.beta1),
                self.beta1.to_string(),
                "from 0 to below 1",
            ),
            (
                "run.beta2",
                part(self.beta2),
                self.beta2.to_string(),
                "from 0 to below 1",
            ),
            (
                "run.decay",
                (0.0..1.0).contains(&self.decay),
                self.decay.to_string(),
                "from 0 to below 1",
            ),
            (
                "run.average",
                part(self.average),
                self.average.to_string(),
                "from 0 to below 1",
            ),
            (
                "run.log_every",
                self.log_every > 0,
                self.log_every.to_string(),
                "at least 1",
            ),
            (
                "run.validate_every",
                self.validate_every > 0,
                self.validate_every.to_string(),
                "at least 1",
            ),
            (
                "run.checkpoint_minutes",
                positive(self.checkpoint_minutes),
                self.checkpoint_minutes.to_string(),
                "above 0",
            ),
        ] {
            if !is_right {
                return Err(TrainError::Setting {
                    name,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }

    /// The learning rate of a step, from 0: it grows evenly at first, and falls along a cosine.
    #[must_use]
    pub fn rate_at(&self, step: u64) -> f64 {
        let warm = (step + 1) as f64 / self.warm_up.max(1) as f64;
        let part = step as f64 / self.steps as f64;
        let cosine = 0.5 + 0.5 * (std::f64::consts::PI * part).cos();
        self.rate * warm.min(1.0) * (self.final_share + (1.0 - self.final_share) * cosine)
    }

    /// The optimiser's settings.
    #[must_use]
    pub fn adam(&self) -> AdamSettings {
        AdamSettings {
            beta1: self.beta1,
            beta2: self.beta2,
            decay: self.decay,
        }
    }
}

impl DataSettings {
    /// Whether all numbers are in range; the recipe checks the others.
    ///
    /// # Errors
    /// [`TrainError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        for (name, is_right, value, allowed) in [
            (
                "data.size",
                self.size > 0 && self.size.is_multiple_of(32),
                self.size.to_string(),
                "a multiple of 32",
            ),
            (
                "data.window",
                self.window > 0,
                self.window.to_string(),
                "at least 1",
            ),
            (
                "data.reuse",
                self.reuse >= 1.0 && self.reuse.is_finite(),
                self.reuse.to_string(),
                "at least 1",
            ),
            (
                "data.plain_share",
                (0.0..=1.0).contains(&self.plain_share),
                self.plain_share.to_string(),
                "from 0 to 1",
            ),
            (
                "data.validation",
                self.validation > 0,
                self.validation.to_string(),
                "at least 1",
            ),
        ] {
            if !is_right {
                return Err(TrainError::Setting {
                    name,
                    value,
                    allowed,
                });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<DecomposeSettings, TrainError> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("settings.toml");
        fs::write(&path, text).unwrap();
        read_settings(&path)
    }

    #[test]
    fn what_a_file_does_not_name_has_its_default() {
        let settings = read("[run]\nsteps = 7\n[loss]\nnormals = 2.0").unwrap();
        assert_eq!(settings.run.steps, 7);
        assert_eq!(settings.run.batch, RunSettings::default().batch);
        assert_eq!(settings.loss.normals, 2.0);
        assert_eq!(settings.data, DataSettings::default());
    }

    #[test]
    fn a_name_that_is_none_is_told_with_its_line() {
        let error = read("[run]\nstep = 7").unwrap_err().to_string();
        assert!(
            error.contains("step") && error.contains("line 2"),
            "{error}"
        );
    }

    #[test]
    fn a_number_out_of_range_is_named() {
        for (text, name) in [
            ("[run]\nrate = -1.0", "run.rate"),
            ("[run]\nbeta1 = 1.0", "run.beta1"),
        ] {
            let error = read(text).unwrap().run.check().unwrap_err().to_string();
            assert!(error.contains(name), "{error}");
        }
        let data = DataSettings {
            size: 100,
            ..DataSettings::default()
        };
        assert!(
            data.check()
                .unwrap_err()
                .to_string()
                .contains("multiple of 32")
        );
    }

    #[test]
    fn the_rate_rises_and_falls() {
        let run = RunSettings {
            steps: 1000,
            ..RunSettings::default()
        };
        assert!(run.rate_at(0) < 0.02 * run.rate);
        assert!(run.rate_at(120) > 0.9 * run.rate);
        assert!((run.rate_at(999) / run.rate - run.final_share).abs() < 1e-3);
    }
}
