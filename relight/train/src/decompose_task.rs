//! The run that trains the decomposing network on composed samples.

use std::sync::Arc;
use std::time::Instant;

use tch::{Cuda, Device, Kind, Tensor};

use super::composed::{ComposedBatches, buffer_settings, composition};
use super::darkness::Darkness;
use super::decompose::{AnsweredTensors, decompose_losses, head_spreads};
use super::error::TrainError;
use super::held_out::{HeldOutSamples, highlight_figures};
use super::learner::{Learner, LearnerSettings};
use super::losses::{angular_degrees, light_degrees, relative_distance, scale_invariant, windowed};
use super::model::{ComputePrecision, Model};
use super::process_group::ProcessGroup;
use super::resources::Resources;
use super::sample::TruthBatch;
use super::settings::{DecomposeSettings, PrecisionChoice, first_difference};
use super::sheet::validation_sheet;
use super::task::{StepLosses, TrainingTask, Validation};
use relight_photo::nets::{LIGHT_PARAMETERS, PAINT_PARAMETERS, Weights, decomposer_with_heads};
use relight_synth::{AlbedoKind, LeftOut};

/// Samples that are shown.
const SHOWN: usize = 10;

/// Training of the decomposing network.
#[derive(Debug)]
pub struct DecomposeTask {
    settings: DecomposeSettings,
    resources: Resources,
    learner: Learner,
    composed: ComposedBatches,
    validation: HeldOutSamples,
    /// The same with print on all objects.
    print: HeldOutSamples,
}

impl DecomposeTask {
    /// Reads what samples are composed of, composes the validation, and begins with `weights`, or with random ones.
    ///
    /// # Errors
    /// Settings out of range, files that cannot be read, weights that do not fit.
    pub fn new(
        settings: DecomposeSettings,
        resources: Resources,
        weights: Option<&Weights>,
    ) -> Result<Self, TrainError> {
        settings.check()?;
        let composition = Arc::new(composition(&settings.data, settings.run.seed)?);
        composition.recipe.check()?;
        let validation = HeldOutSamples::new(&composition, settings.data.validation, None);
        let print = Some(AlbedoKind::Print);
        let print = HeldOutSamples::new(&composition, settings.data.validation.div_ceil(2), print);
        let graph = decomposer_with_heads();
        let initial = || Weights::initial(&graph, settings.run.seed);
        let weights = weights.cloned().unwrap_or_else(initial);
        // Weights from before there was a head for paint or for light begin without one.
        let heads = [PAINT_PARAMETERS, LIGHT_PARAMETERS];
        let weights = heads.into_iter().fold(weights, |weights, head| {
            weights.completed(&graph, head, settings.run.seed)
        });
        let device = resources.device;
        let precision = match settings.run.precision.named() {
            Some(precision) => precision,
            None => fastest(&weights, &validation.first(Kind::Float, device)?, device)?,
        };
        let mut learner = Learner::new(
            graph,
            &weights,
            LearnerSettings {
                adam: settings.run.adam(),
                ema_decay: settings.run.ema_decay,
                precision,
                device: resources.device,
            },
        )?;
        if let Some(head) = settings.only {
            learner.model.train_only(head.parameters())?;
        }
        Ok(Self {
            composed: ComposedBatches::new(
                composition,
                buffer_settings(&settings.data, &settings.run),
                precision.kind(),
                resources.clone(),
            ),
            settings,
            resources,
            learner,
            validation,
            print,
        })
    }

    /// Takes the precision that was the faster one in most of the processes.
    fn choose_precision(&mut self, group: &ProcessGroup) -> Result<(), TrainError> {
        let is_mixed = self.learner.model.precision() == ComputePrecision::Mixed;
        let mut votes = [f64::from(u8::from(is_mixed))];
        group.sum(&mut votes)?;
        let mixed = 2.0 * votes[0] > f64::from(group.rank().world_size());
        self.learner.model.set_precision(if mixed {
            ComputePrecision::Mixed
        } else {
            ComputePrecision::Single
        });
        Ok(())
    }
}

impl TrainingTask for DecomposeTask {
    fn name(&self) -> &'static str {
        "decompose"
    }

    fn settings(&self) -> String {
        // Numbers, names and paths: all of them can be written.
        toml::to_string(&self.settings).unwrap_or_default()
    }

    fn differing_setting(&self, other: &str) -> Option<String> {
        first_difference(&self.settings, other)
    }

    fn left_out(&self) -> &[LeftOut] {
        self.composed.left_out()
    }

    fn learners(&mut self) -> Vec<&mut Learner> {
        vec![&mut self.learner]
    }

    fn join(&mut self, group: &ProcessGroup) -> Result<(), TrainError> {
        self.composed.set_rank(group.rank())?;
        if self.settings.run.precision == PrecisionChoice::Fastest {
            self.choose_precision(group)?;
        }
        Ok(())
    }

    fn step(&mut self, step: u64) -> Result<StepLosses, TrainError> {
        let batch = self.composed.batch(step)?;
        let answer = self.learner.model.forward(&batch.input)?;
        let answer = AnsweredTensors::of_outputs(&batch.input, &answer)?;
        Ok(StepLosses {
            terms: decompose_losses(&batch, &answer, &self.settings.loss)?,
            spreads: head_spreads(&batch, &answer)?,
            batch: batch.named(),
            damage: None,
        })
    }

    fn cursor(&self) -> String {
        self.learner.model.precision().name().to_owned()
    }

    fn go_to(&mut self, place: &str) -> Result<(), String> {
        // What was the faster one at the start need not be now, and other losses would come of it.
        let precision = ComputePrecision::of_name(place);
        let precision = precision.ok_or_else(|| format!("its precision is {place:?}"))?;
        self.learner.model.set_precision(precision);
        Ok(())
    }

    fn validate(&mut self) -> Result<Validation, TrainError> {
        let (model, device) = (self.learner.averaged_model()?, self.resources.device);
        let (kind, mut sheet) = (model.precision().kind(), None);
        let mut found = self.validation.figures(kind, device, |batch| {
            let answer = AnsweredTensors::of_outputs(&batch.input, &model.forward(&batch.input)?)?;
            if sheet.is_none() {
                sheet = Some(validation_sheet(batch, &answer, SHOWN)?);
            }
            figures(batch, &answer)
        })?;
        let of_print = self.print.figures(kind, device, |batch| {
            let answer = AnsweredTensors::of_outputs(&batch.input, &model.forward(&batch.input)?)?;
            figures(batch, &answer)
        })?;
        let of_print = of_print.into_iter();
        found.extend(of_print.map(|(name, value)| (format!("print_{name}"), value)));
        Ok(Validation {
            figures: found,
            sheet,
            damage: None,
        })
    }
}

/// How far the answers are from the ground truth, means over the batch.
fn figures(
    batch: &TruthBatch,
    answer: &AnsweredTensors,
) -> Result<Vec<(&'static str, f64)>, TrainError> {
    let mask = &batch.mask;
    let grey = |of: &Tensor| of.f_mean_dim([1_i64].as_slice(), true, None);
    let diffuse = batch.picture.f_sub(&batch.highlight)?.f_clamp_min(0.0)?;
    let quotient = grey(&diffuse)?.f_div(&answer.shading.f_clamp_min(0.03)?)?;
    let albedo = grey(&batch.albedo)?;
    let window = (mask.size()[2] / 16).max(4);
    let mut figures = highlight_figures(&answer.highlight, batch)?.to_vec();
    let errors = [
        (
            "shading",
            scale_invariant(&answer.shading, &batch.shading, mask)?,
        ),
        ("albedo", scale_invariant(&quotient, &albedo, mask)?),
        (
            "shading_windows",
            windowed(&answer.shading, &batch.shading, mask, window)?,
        ),
        (
            "albedo_windows",
            windowed(&quotient, &albedo, mask, window)?,
        ),
        (
            "normals_deg",
            angular_degrees(&answer.normals, &batch.normals, mask)?,
        ),
    ];
    for (name, error) in errors {
        figures.push((name, f64::try_from(error)?));
    }
    if let Some(logit) = &answer.paint {
        let truth = Darkness::new(&batch.albedo, &batch.shading, mask)?;
        let of_maps = Darkness::new(&quotient, &answer.shading, mask)?;
        for (name, found) in [
            ("paint", &logit.f_sigmoid()?),
            ("paint_of_maps", &of_maps.paint),
        ] {
            let error = truth.squared_error(found)?.value;
            figures.push((name, f64::try_from(error)?));
        }
    }
    if let Some(light) = &answer.light {
        let distance = relative_distance(light, &batch.light)?.value;
        figures.push(("light", f64::try_from(distance)?));
        let degrees = light_degrees(light, &batch.light)?;
        figures.push(("light_deg", f64::try_from(degrees)?));
    }
    Ok(figures)
}

/// The precision in which a step takes less time here, by the best of three steps each on a few samples.
fn fastest(
    weights: &Weights,
    batch: &TruthBatch,
    device: Device,
) -> Result<ComputePrecision, TrainError> {
    let seconds = |precision| -> Result<f64, TrainError> {
        let model = Model::new(decomposer_with_heads(), weights, device, precision)?;
        let mut best = f64::INFINITY;
        for _ in 0..3 {
            let start = Instant::now();
            model.forward(&batch.input)?[0]
                .f_square()?
                .f_mean(None)?
                .f_backward()?;
            // A GPU computes on after the call.
            if let Device::Cuda(number) = device {
                Cuda::synchronize(number as i64);
            }
            best = best.min(start.elapsed().as_secs_f64());
        }
        Ok(best)
    };
    Ok(
        if seconds(ComputePrecision::Mixed)? < seconds(ComputePrecision::Single)? {
            ComputePrecision::Mixed
        } else {
            ComputePrecision::Single
        },
    )
}
