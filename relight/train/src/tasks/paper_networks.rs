//! The networks of the paper's phases: the one that a phase trains, the given ones, and their losses.

use std::iter;
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
use crate::engine::tensors::grey;
use crate::data::turn_reader::TurnTensors;
use crate::engine::losses::{Mean, angular_degrees};
use crate::engine::model::Model;
use crate::error::TrainError;
use crate::settings::{PaperPhase, PaperSettings};
use relight_photo::nets::paper::{Head, light_net, normal_net, reflectance_net, spec_net};
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
pub(crate) enum PhaseNetworks {
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
        let optional = |graph: Graph, weights: &Option<Weights>| {
            let model = weights.as_ref().map(|weights| {
                let mut model = Model::new(graph, weights, device, settings.run.precision)?;
                model.set_trainable(false)?;
                Ok::<_, TrainError>(model)
            });
            model.transpose()
        };
        let spec = || optional(spec_net(), &inputs.spec);
        let normal = || {
            optional(normal_net(), &inputs.normal)?
                .ok_or_else(|| missing_option(phase, "--normal-net"))
        };
        let light = || {
            let model = optional(light_net(Head::Pooled), &inputs.light)?;
            model.ok_or_else(|| missing_option(phase, "--light-net"))
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
                spec: spec()?.ok_or_else(|| missing_option(phase, "--spec-net"))?,
                normal: normal()?,
                light: light()?,
            },
        })
    }

    /// The networks that it uses and does not change.
    pub(crate) fn frozen_models(&self) -> Vec<&Model> {
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

    /// The loss on a batch of synthetic samples, if the phase has one.
    pub(crate) fn supervised_loss(
        &self,
        own: &Model,
        batch: &TruthBatch,
    ) -> Result<Option<Mean>, TrainError> {
        match self {
            Self::Spec => spec_on_truth(own, batch).map(Some),
            Self::Normal | Self::Joint { .. } => normal_on_truth(own, batch).map(Some),
            Self::Light { .. } => light_on_truth(own, batch).map(Some),
            Self::Specular { .. } => Ok(None),
        }
    }

    /// How well the phase's network does on synthetic samples.
    pub(crate) fn sample_figures(
        &self,
        own: &Model,
        batch: &TruthBatch,
    ) -> Result<Vec<(&'static str, f64)>, TrainError> {
        let (picture, mask) = (&batch.picture, &batch.mask);
        Ok(match self {
            Self::Spec => {
                let highlight = highlight_of(own, picture, mask)?;
                let grey = grey(&highlight);
                highlight_figures(&grey, batch)?.to_vec()
            }
            Self::Normal | Self::Joint { .. } => {
                let normals = normals_of(own, &diffuse_of_truth(batch), mask)?;
                let degrees = angular_degrees(&normals, &batch.normals, mask);
                vec![("normals_deg", f64::try_from(degrees)?)]
            }
            Self::Light { .. } => {
                vec![("shading", f64::try_from(light_on_truth(own, batch)?.value)?)]
            }
            Self::Specular { .. } => Vec::new(),
        })
    }

    /// How near what a turn's frames have in common is to rank one: of the pictures as they are, and of what the
    /// phase's networks make of them.
    pub(crate) fn turn_figures(
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
                let Some((picture, mask)) = saturated_frames(turns) else {
                    return Ok(Vec::new());
                };
                let found = diffuse_chromaticity(own, &picture, &mask)?;
                (chromaticity(&picture), found, mask)
            }
            Self::Light { normal, spec } => whole(reflectance(normal, own, spec.as_ref(), turns)?),
            Self::Joint { light, spec } => whole(reflectance(own, light, spec.as_ref(), turns)?),
            Self::Normal | Self::Specular { .. } => return Ok(Vec::new()),
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
        match self {
            Self::Spec => spec_on_turns(own, turns),
            Self::Normal => Ok(None),
            Self::Light { normal, spec } => {
                reflectance_on_turns(normal, own, spec.as_ref(), turns).map(Some)
            }
            Self::Joint { light, spec } => {
                reflectance_on_turns(own, light, spec.as_ref(), turns).map(Some)
            }
            Self::Specular {
                spec,
                normal,
                light,
            } => specular_on_turns(own, (spec, normal, light), turns),
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
        PaperPhase::Light => light_net(Head::Pooled),
        PaperPhase::Specular => reflectance_net(Head::Pooled),
    }
}
