//! The run that trains the decomposing network on photographs of synthetic objects.

use super::decompose::{PredictedTensors, decompose_losses};
use super::validation::{ValidationSamples, highlight_figures};
use crate::data::photographs::Photographs;
use crate::data::sample::TruthBatch;
use crate::distributed::process_group::ProcessGroup;
use crate::engine::losses::{angular_degrees, relative_distance, scale_invariant, windowed};
use crate::engine::task::{Resources, StepLosses, TrainingTask, Validation};
use crate::engine::tensors::grey;
use crate::engine::trainable::Trainable;
use crate::error::TrainError;
use crate::settings::DecomposeSettings;
use relight_photo::nets::{Weights, decomposer_with_light};
use relight_synth::SkippedFile;

/// Training of the decomposing network.
#[derive(Debug)]
pub struct DecomposeTask {
    resources: Resources,
    trainable: Trainable,
    photographs: Photographs,
    validation: ValidationSamples,
}

impl DecomposeTask {
    /// Reads the data of photographs, and starts from `weights`, or from random ones.
    ///
    /// # Errors
    /// Settings out of range, files that cannot be read, weights that do not fit.
    pub fn new(
        settings: DecomposeSettings,
        resources: Resources,
        weights: Option<&Weights>,
    ) -> Result<Self, TrainError> {
        settings.check()?;
        let photographs = Photographs::new(&settings.data, &settings.run, resources.clone())?;
        let (size, count) = (settings.data.size, settings.data.validation);
        let validation = ValidationSamples::new(photographs.library(), size, count);
        let graph = decomposer_with_light();
        let trainable = Trainable::new(graph, weights, &settings.run, resources.device)?;
        Ok(Self {
            photographs,
            resources,
            trainable,
            validation,
        })
    }
}

impl TrainingTask for DecomposeTask {
    fn name(&self) -> &'static str {
        "decompose"
    }

    fn inputs(&self) -> Result<String, TrainError> {
        Ok(self.photographs.library().identity())
    }

    fn left_out(&self) -> &[SkippedFile] {
        self.photographs.left_out()
    }

    fn trainable(&mut self) -> &mut Trainable {
        &mut self.trainable
    }

    fn join(&mut self, group: &ProcessGroup) -> Result<(), TrainError> {
        self.photographs.set_rank(group.rank())
    }

    fn step(&mut self, step: u64) -> Result<StepLosses, TrainError> {
        let batch = self.photographs.batch(step)?;
        let output = self.trainable.model.forward(&batch.input)?;
        let prediction = PredictedTensors::from_outputs(&batch.input, &output);
        Ok(StepLosses {
            terms: decompose_losses(&batch, &prediction),
            damage: None,
        })
    }

    fn validate(&mut self) -> Result<Validation, TrainError> {
        let (model, device) = (self.trainable.average(), self.resources.device);
        let kind = model.precision().kind();
        let figures = self.validation.figures(kind, device, |batch| {
            let prediction =
                PredictedTensors::from_outputs(&batch.input, &model.forward(&batch.input)?);
            figures(batch, &prediction)
        })?;
        Ok(Validation {
            figures,
            damage: None,
        })
    }
}

/// How far the predictions are from the ground truth, means over the batch.
fn figures(
    batch: &TruthBatch,
    prediction: &PredictedTensors,
) -> Result<Vec<(&'static str, f64)>, TrainError> {
    let mask = &batch.mask;
    let diffuse = (&batch.picture - &batch.highlight).clamp_min(0.0);
    let quotient = grey(&diffuse) / prediction.shading.clamp_min(0.03);
    let albedo = grey(&batch.albedo);
    let window = (mask.size()[2] / 16).max(4);
    let mut figures = highlight_figures(&prediction.highlight, batch)?.to_vec();
    let errors = [
        (
            "shading",
            scale_invariant(&prediction.shading, &batch.shading, mask),
        ),
        ("albedo", scale_invariant(&quotient, &albedo, mask)),
        (
            "shading_windows",
            windowed(&prediction.shading, &batch.shading, mask, window),
        ),
        ("albedo_windows", windowed(&quotient, &albedo, mask, window)),
        (
            "normals_deg",
            angular_degrees(&prediction.normals, &batch.normals, mask),
        ),
    ];
    for (name, error) in errors {
        figures.push((name, f64::try_from(error)?));
    }
    if let Some(light) = &prediction.light {
        let distance = relative_distance(light, &batch.light).value;
        figures.push(("light", f64::try_from(distance)?));
    }
    Ok(figures)
}
