//! The settings of a run, as a TOML file has them.

use std::fs;
use std::path::{Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use super::adam::AdamSettings;
use super::decompose::DecomposeWeights;
use super::error::TrainError;
use super::low_rank::LowRankForm;
use super::model::ComputePrecision;
use super::paper_phases::PaperPhase;
use relight_synth::LightKind;

// Nobody trains more: these keep a slip of the pen from filling the memory.
const MOST_STEPS: u64 = 1_000_000_000;
const MOST_SAMPLES: u64 = 1_000_000;
const LARGEST_BATCH: u64 = 4096;
const MOST_MINUTES: f64 = 1e6;
const LARGEST_SIZE: u32 = 1024;
/// Settings that a run may change when it goes on: what it learns does not depend on them.
const HOW_OFTEN: [&str; 2] = ["run.log_every", "run.checkpoint_minutes"];

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
    /// Of `decompose` the faster of single and mixed, by a short measurement when the run begins; a resumed run keeps it.
    /// The paper's networks are small: single.
    Fastest,
}

impl PrecisionChoice {
    /// The precision that it names; none where it is to be found out.
    #[must_use]
    pub fn named(self) -> Option<ComputePrecision> {
        match self {
            Self::Single => Some(ComputePrecision::Single),
            Self::Mixed => Some(ComputePrecision::Mixed),
            Self::Double => Some(ComputePrecision::Double),
            Self::Fastest => None,
        }
    }
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
    /// The loss on frames with labels.
    pub labels: f64,
    /// Which low-rank loss.
    pub form: LowRankForm,
}

impl Default for PaperLosses {
    fn default() -> Self {
        Self {
            low_rank: 1.0,
            anchor: 1.0,
            labels: 1.0,
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
    /// Frames with labels of a step, at least 1, where there are labels.
    pub labelled: u64,
}

impl Default for TurnSettings {
    fn default() -> Self {
        Self {
            groups: 1,
            labelled: 8,
        }
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
    /// The settings of a phase: what the TOML file does not name has its default, the learning rate that of the phase.
    ///
    /// # Errors
    /// As [`read_settings`].
    pub fn of_phase(phase: PaperPhase, file: Option<&Path>) -> Result<Self, TrainError> {
        let mut settings = Self::default();
        let mut names_rate = false;
        if let Some(file) = file {
            let text = read_text(file)?;
            settings = parse(file, &text)?;
            let table: toml::Table = parse(file, &text)?;
            names_rate = table
                .get("run")
                .is_some_and(|run| run.get("rate").is_some());
        }
        if !names_rate {
            settings.run.rate = phase.usual_rate();
        }
        Ok(settings)
    }

    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Setting`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        self.run.check()?;
        self.data.check()?;
        check_weights(&[
            ("loss.low_rank", self.loss.low_rank),
            ("loss.anchor", self.loss.anchor),
            ("loss.labels", self.loss.labels),
        ])?;
        for (name, value) in [
            ("turns.groups", self.turns.groups),
            ("turns.labelled", self.turns.labelled),
        ] {
            if !(1..=MOST_SAMPLES).contains(&value) {
                return Err(TrainError::Setting {
                    name,
                    value: value.to_string(),
                    allowed: "from 1 to a million",
                });
            }
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
        self.data.check()?;
        let loss = &self.loss;
        check_weights(&[
            ("loss.whole", loss.whole),
            ("loss.windows", loss.windows),
            ("loss.gradient", loss.gradient),
            ("loss.normals", loss.normals),
            ("loss.highlight", loss.highlight),
            ("loss.highlight_energy", loss.highlight_energy),
        ])?;
        // A part of others: alone it counts nothing.
        check_weight("loss.quotient", loss.quotient)
    }
}

/// Whether weights of losses are in range, and not all of them 0.
fn check_weights(weights: &[(&'static str, f64)]) -> Result<(), TrainError> {
    for &(name, weight) in weights {
        check_weight(name, weight)?;
    }
    match weights {
        [(name, _), ..] if weights.iter().all(|&(_, weight)| weight == 0.0) => {
            Err(TrainError::Setting {
                name,
                value: "0, as all others of [loss] are".to_owned(),
                allowed: "above 0 for one of them",
            })
        }
        _ => Ok(()),
    }
}

fn check_weight(name: &'static str, weight: f64) -> Result<(), TrainError> {
    if weight >= 0.0 && weight.is_finite() {
        return Ok(());
    }
    Err(TrainError::Setting {
        name,
        value: weight.to_string(),
        allowed: "a number from 0",
    })
}

/// Reads settings from a TOML file; what it does not name has its default, and a name that is none is an
/// error.
///
/// # Errors
/// [`TrainError::Io`] or [`TrainError::Settings`].
pub fn read_settings<S: DeserializeOwned>(path: &Path) -> Result<S, TrainError> {
    parse(path, &read_text(path)?)
}

fn read_text(path: &Path) -> Result<String, TrainError> {
    fs::read_to_string(path).map_err(|source| TrainError::Io {
        path: path.to_owned(),
        doing: "read",
        source,
    })
}

fn parse<S: DeserializeOwned>(path: &Path, text: &str) -> Result<S, TrainError> {
    toml::from_str(text).map_err(|error| TrainError::Settings {
        path: path.to_owned(),
        fault: error.to_string(),
    })
}

/// The first setting, such as `run.seed`, that another run's settings have otherwise, or why they are none; `None` where
/// all that count are the same. What their text does not name has its default, as in a file.
pub(super) fn first_difference<S: Serialize + DeserializeOwned>(
    own: &S,
    other: &str,
) -> Option<String> {
    let table = |settings: &S| toml::Table::try_from(settings).unwrap_or_default();
    match toml::from_str::<S>(other) {
        Ok(other) => differing_name("", &table(own), &table(&other)),
        Err(fault) => Some(fault.message().to_owned()),
    }
}

fn differing_name(within: &str, one: &toml::Table, two: &toml::Table) -> Option<String> {
    one.keys().chain(two.keys()).find_map(|key| {
        let name = format!("{within}{key}");
        if HOW_OFTEN.contains(&name.as_str()) {
            return None;
        }
        match (one.get(key), two.get(key)) {
            (Some(toml::Value::Table(one)), Some(toml::Value::Table(two))) => {
                differing_name(&format!("{name}."), one, two)
            }
            (one, two) => (one != two).then_some(name),
        }
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
        all_allowed([
            (
                "run.steps",
                (1..=MOST_STEPS).contains(&self.steps),
                self.steps.to_string(),
                "from 1 to a thousand million",
            ),
            (
                "run.batch",
                (1..=LARGEST_BATCH).contains(&self.batch),
                self.batch.to_string(),
                "from 1 to 4096",
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
                positive(self.checkpoint_minutes) && self.checkpoint_minutes <= MOST_MINUTES,
                self.checkpoint_minutes.to_string(),
                "above 0 and at most a million",
            ),
        ])
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
        all_allowed([
            (
                "data.size",
                (32..=LARGEST_SIZE).contains(&self.size) && self.size.is_multiple_of(32),
                self.size.to_string(),
                "a multiple of 32 up to 1024",
            ),
            (
                "data.window",
                (1..=MOST_SAMPLES).contains(&self.window),
                self.window.to_string(),
                "from 1 to a million",
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
                (1..=MOST_SAMPLES).contains(&self.validation),
                self.validation.to_string(),
                "from 1 to a million",
            ),
        ])
    }
}

/// The first setting that is not allowed: its name, whether it is allowed, its value, and what is allowed.
fn all_allowed<const N: usize>(
    settings: [(&'static str, bool, String, &'static str); N],
) -> Result<(), TrainError> {
    match settings
        .into_iter()
        .find(|&(_, is_allowed, ..)| !is_allowed)
    {
        Some((name, _, value, allowed)) => Err(TrainError::Setting {
            name,
            value,
            allowed,
        }),
        None => Ok(()),
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
    fn a_phase_has_its_own_learning_rate_where_none_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("settings.toml");
        let rate = |phase, text: &str| {
            fs::write(&file, text).unwrap();
            let settings = PaperSettings::of_phase(phase, Some(&file)).unwrap();
            settings.run.rate
        };
        let longer = "[run]\nsteps = 7\n";
        assert_eq!(rate(PaperPhase::Joint, longer), 1e-6);
        assert_eq!(rate(PaperPhase::Normal, longer), 1e-4);
        assert_eq!(rate(PaperPhase::Joint, "[run]\nrate = 1e-3\n"), 1e-3);
        let without = PaperSettings::of_phase(PaperPhase::Light, None).unwrap();
        assert_eq!(without.run.rate, 1e-4);
    }

    #[test]
    fn the_setting_that_differs_is_named() {
        let own = DecomposeSettings::default();
        let whole = toml::to_string(&own).unwrap();
        assert_eq!(first_difference(&own, &whole), None);
        let older = whole.replace("validate_every = 250\n", "");
        assert_ne!(older, whole);
        assert_eq!(first_difference(&own, &older), None);
        let other = whole.replace("seed = 1\n", "seed = 2\n");
        assert_eq!(first_difference(&own, &other).unwrap(), "run.seed");
        let meshes = format!("{}\nmeshes = \"m\"", "[data]");
        assert_eq!(first_difference(&own, &meshes).unwrap(), "data.meshes");
        let often = whole.replace("log_every = 20\n", "log_every = 5\n");
        assert_ne!(often, whole);
        assert_eq!(first_difference(&own, &often), None);
        let unknown = "[run]\nspeed = 3";
        assert!(first_difference(&own, unknown).unwrap().contains("speed"));
    }

    #[test]
    fn a_number_out_of_range_is_named() {
        for (text, name) in [
            ("[run]\nrate = -1.0", "run.rate"),
            ("[run]\nbeta1 = 1.0", "run.beta1"),
            (
                "[run]\ncheckpoint_minutes = 1e300",
                "run.checkpoint_minutes",
            ),
            ("[run]\nbatch = 1000000000000", "run.batch"),
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
    fn weights_of_losses_that_teach_nothing_are_named() {
        let losses = DecomposeWeights::default();
        let error = |loss: DecomposeWeights| {
            let settings = DecomposeSettings {
                loss,
                ..DecomposeSettings::default()
            };
            settings.check().map_err(|error| error.to_string())
        };
        assert_eq!(error(losses), Ok(()));
        for whole in [-1.0, f64::NAN, f64::INFINITY] {
            let told = error(DecomposeWeights { whole, ..losses }).unwrap_err();
            assert!(told.contains("loss.whole"), "{told}");
        }
        let quotient = -0.5;
        assert!(error(DecomposeWeights { quotient, ..losses }).is_err());
        let nothing = DecomposeWeights {
            whole: 0.0,
            quotient: 0.5,
            windows: 0.0,
            gradient: 0.0,
            normals: 0.0,
            highlight: 0.0,
            highlight_energy: 0.0,
        };
        let told = error(nothing).unwrap_err();
        assert!(told.contains("all others"), "{told}");
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
