//! The networks of the paper's phases: the one that a phase trains, the given ones, and their losses.

use std::path::PathBuf;

use tch::{Device, Tensor};

use super::low_rank::chromaticity;
use super::paper_phases::{
    diffuse_chromaticity, diffuse_of_truth, highlight_of, light_on_truth, normal_on_truth,
    normals_of, reflectance, reflectance_on_turns, saturated_frames, spec_on_truth, spec_on_turns,
    specular_on_turns,
};
use super::validation::{highlight_figures, rank_residual};
use crate::data::sample::TruthBatch;
use crate::data::turn_reader::TurnTensors;
use crate::engine::losses::{Mean, angular_degrees};
use crate::engine::model::Model;
use crate::engine::tensors::grey;
use crate::error::TrainError;
use crate::settings::{PaperPhase, PaperSettings};
use relight_photo::nets::paper::{light_net, normal_net, reflectance_net, spec_net};
use relight_photo::nets::{Graph, Weights};

/// What a run of a phase is given.
#[derive(Debug, Clone, Default)]
pub struct PaperInputs {
    /// A data set of turns.
    pub turns: Option<PathBuf>,
    /// A data set of turns that the networks are judged by, and that should not be among `turns`.
    pub validation_turns: Option<PathBuf>,
    /// Weights to begin with.
    pub weights: Option<Weights>,
    /// Spec-Net's weights.
    pub spec: Option<Weights>,
    /// Normal-Net's weights.
    pub normal: Option<Weights>,
    /// Light-Net's weights.
    pub light: Option<Weights>,
}

/// A phase, with the networks that it uses and does not change.
#[derive(Debug)]
pub(crate) struct PhaseNetworks {
    pub(super) phase: PaperPhase,
    spec: Option<Model>,
    normal: Option<Model>,
    light: Option<Model>,
}

/// The options of the networks that a phase needs, and of those that it takes.
fn options(phase: PaperPhase) -> (&'static [&'static str], &'static [&'static str]) {
    match phase {
        PaperPhase::Spec | PaperPhase::Normal => (&[], &[]),
        PaperPhase::Light => (&["--normal-net"], &["--spec-net"]),
        PaperPhase::Joint => (&["--light-net"], &["--spec-net"]),
        PaperPhase::Specular => (&["--spec-net", "--normal-net", "--light-net"], &[]),
    }
}

impl PhaseNetworks {
    /// Reads the networks that the phase is given.
    ///
    /// # Errors
    /// [`TrainError::Refused`] if one is missing, those of [`Model::new`].
    pub(crate) fn new(
        phase: PaperPhase,
        settings: &PaperSettings,
        device: Device,
        inputs: &PaperInputs,
    ) -> Result<Self, TrainError> {
        let (needed, taken) = options(phase);
        let model = |option: &'static str, graph: Graph, weights: &Option<Weights>| {
            let weights = weights.as_ref();
            if needed.contains(&option) && weights.is_none() {
                return Err(missing_option(phase, option));
            }
            let is_used = needed.contains(&option) || taken.contains(&option);
            let model = weights.filter(|_| is_used).map(|weights| {
                let mut model = Model::new(graph, weights, device, settings.run.precision)?;
                model.set_trainable(false)?;
                Ok(model)
            });
            model.transpose()
        };
        Ok(Self {
            phase,
            spec: model("--spec-net", spec_net(), &inputs.spec)?,
            normal: model("--normal-net", normal_net(), &inputs.normal)?,
            light: model("--light-net", light_net(), &inputs.light)?,
        })
    }

    /// The networks that it uses and does not change.
    pub(crate) fn frozen_models(&self) -> impl Iterator<Item = &Model> {
        [&self.normal, &self.light, &self.spec]
            .into_iter()
            .flatten()
    }

    /// Normal-Net and Light-Net; the phase trains one of them.
    fn normal_and_light<'a>(&'a self, own: &'a Model) -> (&'a Model, &'a Model) {
        let or_own = |model: &'a Option<Model>| model.as_ref().unwrap_or(own);
        (or_own(&self.normal), or_own(&self.light))
    }

    /// The loss on a batch of synthetic samples, if the phase has one.
    pub(crate) fn supervised_loss(
        &self,
        own: &Model,
        batch: &TruthBatch,
    ) -> Result<Option<Mean>, TrainError> {
        match self.phase {
            PaperPhase::Spec => spec_on_truth(own, batch).map(Some),
            PaperPhase::Normal | PaperPhase::Joint => normal_on_truth(own, batch).map(Some),
            PaperPhase::Light => light_on_truth(own, batch).map(Some),
            PaperPhase::Specular => Ok(None),
        }
    }

    /// How well the phase's network does on synthetic samples.
    pub(crate) fn sample_figures(
        &self,
        own: &Model,
        batch: &TruthBatch,
    ) -> Result<Vec<(&'static str, f64)>, TrainError> {
        let (picture, mask) = (&batch.picture, &batch.mask);
        Ok(match self.phase {
            PaperPhase::Spec => {
                let highlight = highlight_of(own, picture, mask)?;
                let grey = grey(&highlight);
                highlight_figures(&grey, batch)?.to_vec()
            }
            PaperPhase::Normal | PaperPhase::Joint => {
                let normals = normals_of(own, &diffuse_of_truth(batch), mask)?;
                let degrees = angular_degrees(&normals, &batch.normals, mask);
                vec![("normals_deg", f64::try_from(degrees)?)]
            }
            PaperPhase::Light => {
                vec![("shading", f64::try_from(light_on_truth(own, batch)?.value)?)]
            }
            PaperPhase::Specular => Vec::new(),
        })
    }

    /// How near what a turn's frames have in common is to rank one: of the pictures as they are, and of what the
    /// phase's networks make of them.
    pub(crate) fn turn_figures(
        &self,
        own: &Model,
        turns: &TurnTensors,
    ) -> Result<Vec<(&'static str, f64)>, TrainError> {
        let (raw, found, mask) = match self.phase {
            PaperPhase::Spec => {
                let Some((picture, mask)) = saturated_frames(turns) else {
                    return Ok(Vec::new());
                };
                let found = diffuse_chromaticity(own, &picture, &mask)?;
                (chromaticity(&picture), found, mask)
            }
            PaperPhase::Light | PaperPhase::Joint => {
                let (normal, light) = self.normal_and_light(own);
                let found = reflectance(normal, light, self.spec.as_ref(), turns)?;
                (
                    turns.picture.shallow_clone(),
                    found,
                    turns.mask.shallow_clone(),
                )
            }
            PaperPhase::Normal | PaperPhase::Specular => return Ok(Vec::new()),
        };
        Ok(vec![
            ("pictures_residual", rank_residual(&raw, &mask)?),
            ("residual", rank_residual(&found, &mask)?),
        ])
    }

    /// The loss on a batch of turns; `None` if the gate of saturation is closed.
    pub(crate) fn turn_loss(
        &self,
        own: &Model,
        turns: &TurnTensors,
    ) -> Result<Option<Tensor>, TrainError> {
        let (normal, light) = self.normal_and_light(own);
        match (self.phase, &self.spec) {
            (PaperPhase::Spec, _) => spec_on_turns(own, turns),
            (PaperPhase::Light | PaperPhase::Joint, spec) => {
                reflectance_on_turns(normal, light, spec.as_ref(), turns).map(Some)
            }
            (PaperPhase::Specular, Some(spec)) => {
                specular_on_turns(own, (spec, normal, light), turns)
            }
            (PaperPhase::Normal | PaperPhase::Specular, _) => Ok(None),
        }
    }
}

pub(crate) fn missing_option(phase: PaperPhase, option: &str) -> TrainError {
    TrainError::Refused(format!("relight train {} needs {option}", phase.name()))
}

/// The network that a phase trains.
pub(crate) fn trained_graph(phase: PaperPhase) -> Graph {
    match phase {
        PaperPhase::Spec => spec_net(),
        PaperPhase::Normal | PaperPhase::Joint => normal_net(),
        PaperPhase::Light => light_net(),
        PaperPhase::Specular => reflectance_net(),
    }
}
