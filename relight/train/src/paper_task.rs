//! The runs of the paper's phases.

use std::iter;
use std::path::PathBuf;
use std::sync::Arc;

use tch::{Device, Kind, Tensor};

use super::agreement::fingerprint;
use super::composed::{ComposedBatches, composition, window_settings};
use super::decompose_task::Resources;
use super::error::TrainError;
use super::held_out::{HeldOutSamples, HeldOutTurns, highlight_figures, rank_figures};
use super::labelled::LabelledFrames;
use super::learner::{Learner, LearnerSettings};
use super::losses::{Mean, angular_degrees};
use super::low_rank::chromaticity;
use super::model::{ComputePrecision, Model};
use super::paper_phases::{
    PaperPhase, TruthLoss, diffuse_chromaticity, highlight_of, light_on_truth, normal_on_truth,
    normals_of, reflectance, reflectance_on_turns, saturated_frames, spec_on_truth, spec_on_turns,
    specular_on_turns,
};
use super::process_group::ProcessGroup;
use super::run::{StepLosses, Task, Validation};
use super::sample::TruthBatch;
use super::settings::{PaperSettings, first_difference};
use super::turn_reader::{TurnGroup, TurnReader, TurnTensors};
use relight_nets::paper::{Head, light_net, normal_net, reflectance_net, spec_net};
use relight_nets::{Graph, Weights};
use relight_reader::Share;
use relight_synth::stream;

/// What a run of a phase is given.
#[derive(Debug, Clone, Default)]
pub struct PaperInputs {
    /// A data set of turns.
    pub turns: Option<PathBuf>,
    /// A data set of turns that the networks are judged by, and that should not be among `turns`.
    pub held_out: Option<PathBuf>,
    /// Frames with labels, in the layout of `relight synth`.
    pub labels: Option<PathBuf>,
    /// Weights to begin with.
    pub weights: Option<Weights>,
    /// Spec-Net's weights.
    pub spec: Option<Weights>,
    /// Normal-Net's weights.
    pub normal: Option<Weights>,
    /// Light-Net's weights.
    pub light: Option<Weights>,
}

/// Training of one of the paper's networks.
#[derive(Debug)]
pub struct PaperTask {
    phase: Phase,
    name: &'static str,
    settings: PaperSettings,
    resources: Resources,
    learner: Learner,
    composed: ComposedBatches,
    turns: Option<TurnReader>,
    labels: Option<LabelledFrames>,
    share: Share,
    held_out_samples: HeldOutSamples,
    held_out_turns: Option<HeldOutTurns>,
}

/// A phase, with the networks that it uses and does not change.
#[derive(Debug)]
enum Phase {
    Spec,
    Normal,
    Light {
        normal: Model,
        spec: Option<Model>,
    },
    Joint {
        light: Model,
        spec: Option<Model>,
    },
    Specular {
        spec: Model,
        normal: Model,
        light: Model,
    },
}

impl PaperTask {
    /// Reads what samples are composed of, opens the turns, and makes the networks.
    ///
    /// # Errors
    /// Settings out of range, files that cannot be read, weights that do not fit, [`TrainError::Needed`] where the phase
    /// needs what is not given.
    pub fn new(
        phase: PaperPhase,
        settings: PaperSettings,
        resources: Resources,
        inputs: &PaperInputs,
    ) -> Result<Self, TrainError> {
        settings.check()?;
        if phase.needs_turns() && inputs.turns.is_none() {
            return Err(needed(phase, "--turns"));
        }
        if inputs.turns.is_some() && !phase.learns_from_turns() {
            return Err(TrainError::NotTaught {
                phase: phase.name(),
            });
        }
        if inputs.held_out.is_some() && !phase.is_judged_by_turns() {
            return Err(TrainError::NotJudged {
                phase: phase.name(),
            });
        }
        if inputs.labels.is_some() && phase == PaperPhase::Specular {
            return Err(TrainError::NotLabelled {
                phase: phase.name(),
            });
        }
        let graph = learned(phase);
        let initial = || Weights::initial(&graph, settings.run.seed);
        let weights = inputs.weights.clone().unwrap_or_else(initial);
        let learner = LearnerSettings {
            adam: settings.run.adam(),
            average: settings.run.average,
            precision: precision(&settings),
            device: resources.device,
        };
        let seed = stream(settings.run.seed, 31);
        let open = |path: &PathBuf| TurnReader::open(path, seed);
        let labels = |path: &PathBuf| LabelledFrames::open(path, stream(settings.run.seed, 32));
        let held_out = |path: &PathBuf| {
            HeldOutTurns::read(path, precision(&settings).kind(), resources.device)
        };
        let composition = Arc::new(composition(&settings.data, settings.run.seed)?);
        // On them, nothing is known of the paper's smoothness.
        let samples = match phase {
            PaperPhase::Specular => 0,
            _ => settings.data.validation,
        };
        Ok(Self {
            held_out_samples: HeldOutSamples::new(&composition, samples),
            held_out_turns: inputs.held_out.as_ref().map(held_out).transpose()?,
            phase: Phase::new(phase, &settings, resources.device, inputs)?,
            name: phase.name(),
            learner: Learner::new(graph, &weights, learner)?,
            composed: ComposedBatches::new(
                composition,
                window_settings(&settings.data, &settings.run),
                precision(&settings).kind(),
                resources.clone(),
            ),
            turns: inputs.turns.as_ref().map(open).transpose()?,
            labels: inputs.labels.as_ref().map(labels).transpose()?,
            share: Share::ALL,
            settings,
            resources,
        })
    }

    /// The type of what goes into the network.
    fn kind(&self) -> Kind {
        precision(&self.settings).kind()
    }

    /// The losses on this process's groups of a step.
    fn on_turns(&mut self, losses: &mut StepLosses) -> Result<(), TrainError> {
        let kind = self.kind();
        let Some(reader) = &mut self.turns else {
            return Ok(());
        };
        let (mut values, mut damage) = (Vec::new(), Vec::new());
        for group in 0..self.settings.turns.groups / u64::from(self.share.of()) {
            let TurnGroup {
                frames,
                damage: found,
            } = reader.next_group(kind, self.resources.device)?;
            damage.extend(found);
            if let Some(turns) = frames {
                let own = &self.learner.model;
                values.extend(self.phase.on_turns(own, &turns, &self.settings)?);
                let name = format!("turns.{group}");
                losses.batch.insert(name, turns.picture);
            }
        }
        losses.add_damage(&damage);
        let weight = self.settings.loss.low_rank;
        if values.is_empty() {
            losses.terms.add_nothing("turns", weight);
        } else {
            let over = Tensor::f_from_slice(&[values.len() as i64])?;
            let value = Tensor::f_stack(&values, 0)?.f_mean(None)?;
            losses.terms.add_mean("turns", weight, Mean { value, over });
        }
        Ok(())
    }

    /// The loss on this process's frames with labels of a step.
    fn on_labels(&self, step: u64, losses: &mut StepLosses) -> Result<(), TrainError> {
        let Some(labels) = &self.labels else {
            return Ok(());
        };
        let weight = self.settings.loss.labels;
        let drawn = labels.batch(step, self.settings.turns.labelled);
        losses.add_damage(&drawn.damage);
        let frames = drawn.drawn();
        let batch = match frames.as_slice() {
            [] => None,
            frames => Some(TruthBatch::new(frames, self.kind(), self.resources.device)?),
        };
        let loss = batch
            .as_ref()
            .map(|batch| self.phase.on_truth(&self.learner.model, batch));
        match loss.transpose()?.flatten() {
            Some(loss) => losses.terms.add_mean("labels", weight, loss.mean),
            None => losses.terms.add_nothing("labels", weight),
        }
        for (name, tensor) in batch.iter().flat_map(TruthBatch::named) {
            losses.batch.insert(format!("labels.{name}"), tensor);
        }
        Ok(())
    }

    /// What composed samples count: all, where there are no turns.
    fn anchor(&self) -> f64 {
        match (&self.phase, &self.turns) {
            (Phase::Specular { .. }, _) => 0.0,
            (Phase::Normal, _) | (_, None) => 1.0,
            (_, Some(_)) => self.settings.loss.anchor,
        }
    }
}

impl Phase {
    fn new(
        phase: PaperPhase,
        settings: &PaperSettings,
        device: Device,
        inputs: &PaperInputs,
    ) -> Result<Self, TrainError> {
        let optional = |graph: Graph, weights: &Option<Weights>| {
            let model = weights.as_ref().map(|weights| {
                let mut model = Model::new(graph, weights, device, precision(settings))?;
                model.set_trainable(false)?;
                Ok::<_, TrainError>(model)
            });
            model.transpose()
        };
        let spec = || optional(spec_net(), &inputs.spec);
        let normal =
            || optional(normal_net(), &inputs.normal)?.ok_or_else(|| needed(phase, "--normal"));
        let light = || {
            let model = optional(light_net(Head::Pooled), &inputs.light)?;
            model.ok_or_else(|| needed(phase, "--light"))
        };
        Ok(match phase {
            PaperPhase::Spec => Self::Spec,
            PaperPhase::Normal => Self::Normal,
            PaperPhase::Light => Self::Light {
                normal: normal()?,
                spec: spec()?,
            },
            PaperPhase::Joint => Self::Joint {
                light: light()?,
                spec: spec()?,
            },
            PaperPhase::Specular => Self::Specular {
                spec: spec()?.ok_or_else(|| needed(phase, "--spec"))?,
                normal: normal()?,
                light: light()?,
            },
        })
    }

    /// The networks that it uses and does not change.
    fn given(&self) -> Vec<&Model> {
        match self {
            Self::Spec | Self::Normal => Vec::new(),
            Self::Light { normal, spec } => iter::once(normal).chain(spec).collect(),
            Self::Joint { light, spec } => iter::once(light).chain(spec).collect(),
            Self::Specular {
                spec,
                normal,
                light,
            } => vec![spec, normal, light],
        }
    }

    /// The loss on a batch of composed samples; none where the phase has none.
    fn on_truth(&self, own: &Model, batch: &TruthBatch) -> Result<Option<TruthLoss>, TrainError> {
        match self {
            Self::Spec => spec_on_truth(own, batch).map(Some),
            Self::Normal | Self::Joint { .. } => normal_on_truth(own, batch).map(Some),
            Self::Light { .. } => light_on_truth(own, batch).map(Some),
            Self::Specular { .. } => Ok(None),
        }
    }

    /// How well the phase's network does on composed samples.
    fn sample_figures(
        &self,
        own: &Model,
        batch: &TruthBatch,
    ) -> Result<Vec<(&'static str, f64)>, TrainError> {
        let (picture, mask) = (&batch.picture, &batch.mask);
        Ok(match self {
            Self::Spec => {
                let highlight = highlight_of(own, picture, mask)?;
                let grey = highlight.f_mean_dim([1_i64].as_slice(), true, None)?;
                highlight_figures(&grey, batch)?.to_vec()
            }
            Self::Normal | Self::Joint { .. } => {
                let normals = normals_of(own, picture, mask)?;
                let degrees = angular_degrees(&normals, &batch.normals, mask)?;
                vec![("normals_deg", f64::try_from(degrees)?)]
            }
            Self::Light { .. } => {
                vec![(
                    "shading",
                    f64::try_from(light_on_truth(own, batch)?.mean.value)?,
                )]
            }
            Self::Specular { .. } => Vec::new(),
        })
    }

    /// How near what a turn's frames have in common is to rank one: of the pictures as they are, and of what the
    /// phase's networks make of them.
    fn turn_figures(
        &self,
        own: &Model,
        turns: &TurnTensors,
    ) -> Result<Vec<(&'static str, f64)>, TrainError> {
        let whole = |found| {
            (
                turns.picture.shallow_clone(),
                found,
                turns.mask.shallow_clone(),
            )
        };
        let (raw, found, mask) = match self {
            Self::Spec => {
                let Some((picture, mask)) = saturated_frames(turns)? else {
                    return Ok(Vec::new());
                };
                let found = diffuse_chromaticity(own, &picture, &mask)?;
                (chromaticity(&picture)?, found, mask)
            }
            Self::Light { normal, spec } => whole(reflectance(normal, own, spec.as_ref(), turns)?),
            Self::Joint { light, spec } => whole(reflectance(own, light, spec.as_ref(), turns)?),
            Self::Normal | Self::Specular { .. } => return Ok(Vec::new()),
        };
        let (raw, found) = (rank_figures(&raw, &mask)?, rank_figures(&found, &mask)?);
        Ok(vec![
            ("pictures_residual", raw.0),
            ("pictures_sigma_ratio", raw.1),
            ("residual", found.0),
            ("sigma_ratio", found.1),
        ])
    }

    /// The loss on a batch of turns; none where the gate of saturation is closed.
    fn on_turns(
        &self,
        own: &Model,
        turns: &TurnTensors,
        settings: &PaperSettings,
    ) -> Result<Option<Tensor>, TrainError> {
        let form = settings.loss.form;
        match self {
            Self::Spec => spec_on_turns(own, turns, form),
            Self::Normal => Ok(None),
            Self::Light { normal, spec } => {
                reflectance_on_turns(normal, own, spec.as_ref(), turns, form).map(Some)
            }
            Self::Joint { light, spec } => {
                reflectance_on_turns(own, light, spec.as_ref(), turns, form).map(Some)
            }
            Self::Specular {
                spec,
                normal,
                light,
            } => specular_on_turns(own, (spec, normal, light), turns),
        }
    }
}

impl Task for PaperTask {
    fn name(&self) -> &'static str {
        self.name
    }

    fn settings(&self) -> String {
        // Numbers, names and paths: all of them can be written.
        toml::to_string(&self.settings).unwrap_or_default()
    }

    fn differing_setting(&self, other: &str) -> Option<String> {
        first_difference(&self.settings, other)
    }

    fn learners(&mut self) -> Vec<&mut Learner> {
        vec![&mut self.learner]
    }

    fn inputs(&self) -> Result<String, TrainError> {
        let mut inputs = self
            .turns
            .as_ref()
            .map_or(String::new(), TurnReader::identity);
        inputs += &self
            .labels
            .as_ref()
            .map_or(String::new(), LabelledFrames::identity);
        for model in self.phase.given() {
            inputs += &fingerprint(model.parameters())?;
        }
        Ok(inputs)
    }

    fn join(&mut self, group: &ProcessGroup) -> Result<(), TrainError> {
        let (share, groups) = (group.share(), self.settings.turns.groups);
        if self.anchor() > 0.0 {
            self.composed.take_share(share)?;
        }
        if let Some(reader) = &mut self.turns {
            if !groups.is_multiple_of(u64::from(share.of())) {
                return Err(TrainError::Indivisible {
                    name: "turns.groups",
                    value: groups,
                    of: share.of(),
                    needed: format!("a multiple of {}", share.of()),
                });
            }
            reader.take_share(share)?;
        }
        if let Some(labels) = &mut self.labels {
            labels.take_share(share);
        }
        self.share = share;
        Ok(())
    }

    fn step(&mut self, step: u64) -> Result<StepLosses, TrainError> {
        let mut losses = StepLosses::default();
        let anchor = self.anchor();
        if anchor > 0.0 {
            let batch = self.composed.batch(step)?;
            if let Some(loss) = self.phase.on_truth(&self.learner.model, &batch)? {
                losses.terms.add_mean("truth", anchor, loss.mean);
                losses.spreads.insert(loss.head, loss.spread);
            }
            losses.batch.extend(batch.named());
        }
        self.on_turns(&mut losses)?;
        self.on_labels(step, &mut losses)?;
        Ok(losses)
    }

    fn validate(&mut self) -> Result<Validation, TrainError> {
        let own = self.learner.averaged_model()?;
        let device = self.resources.device;
        let mut figures = self
            .held_out_samples
            .figures(self.kind(), device, |batch| {
                self.phase.sample_figures(&own, batch)
            })?;
        let mut damage = None;
        if let Some(turns) = &mut self.held_out_turns {
            damage = turns.take_damage();
            figures.extend(turns.figures(|turns| self.phase.turn_figures(&own, turns))?);
        }
        Ok(Validation {
            figures,
            sheet: None,
            damage,
        })
    }

    fn place(&self) -> String {
        let place = self.turns.as_ref().map(TurnReader::place);
        // Two numbers: they can be written.
        serde_json::to_string(&place).unwrap_or_default()
    }

    fn go_to(&mut self, place: &str) -> Result<(), String> {
        let place: Option<relight_reader::Place> =
            serde_json::from_str(place).map_err(|error| error.to_string())?;
        match (&mut self.turns, place) {
            (Some(reader), Some(place)) => reader.go_to(place).map_err(|error| error.to_string()),
            (None, None) => Ok(()),
            _ => Err("it was trained with turns, or without, and this run is not".to_owned()),
        }
    }
}

fn needed(phase: PaperPhase, option: &'static str) -> TrainError {
    TrainError::Needed {
        phase: phase.name(),
        option,
    }
}

/// The network that a phase trains.
fn learned(phase: PaperPhase) -> Graph {
    match phase {
        PaperPhase::Spec => spec_net(),
        PaperPhase::Normal | PaperPhase::Joint => normal_net(),
        PaperPhase::Light => light_net(Head::Pooled),
        PaperPhase::Specular => reflectance_net(Head::Pooled),
    }
}

/// Single where nothing else was asked for: these networks are small.
fn precision(settings: &PaperSettings) -> ComputePrecision {
    settings
        .run
        .precision
        .named()
        .unwrap_or(ComputePrecision::Single)
}
