//! The run that trains the network of whole turns.

use tch::{Kind, Tensor, no_grad};

use crate::data::turns::{TurnBatch, Turns};
use crate::distributed::process_group::ProcessGroup;
use crate::engine::losses::{Mean, angular_degrees, chord};
use crate::engine::task::{Resources, StepLosses, TrainingTask, Validation};
use crate::engine::tensors::over_channels;
use crate::engine::terms::LossTerms;
use crate::engine::trainable::Trainable;
use crate::error::TrainError;
use crate::settings::TurnNetworkSettings;
use relight_photo::nets::{LOG_MEANS, Weights, turn_network};
use relight_synth::{SkippedFile, stream};

/// The loss coefficient of the expected error; that of the normals is 1.
const EXPECTED_ERROR: f64 = 0.05;
/// The loss coefficient of the albedo; that of the normals is 1.
const ALBEDO: f64 = 0.5;
/// Range of the logarithm of the expected chord while training.
const LOG_CHORD: (f64, f64) = (-4.0, 1.0);
/// Turns of a batch of validation.
const VALIDATION_BATCH: u64 = 8;
/// Expected errors for which validation counts the pixels within them, degrees.
const WITHIN_DEG: [(f64, &str); 2] = [(10.0, "within_10"), (20.0, "within_20")];

/// Training of the network of whole turns.
#[derive(Debug)]
pub struct TurnNetworkTask {
    settings: TurnNetworkSettings,
    trainable: Trainable,
    training: Turns,
    validation: Turns,
    /// The batches of validation, made once.
    validated: Vec<TurnBatch>,
}

impl TurnNetworkTask {
    /// Begins with `weights`, or with random ones.
    ///
    /// # Errors
    /// Settings out of range, files that cannot be read, weights that do not fit.
    pub fn new(
        settings: TurnNetworkSettings,
        resources: Resources,
        weights: Option<&Weights>,
    ) -> Result<Self, TrainError> {
        settings.check()?;
        let graph = turn_network();
        let trainable = Trainable::new(graph, weights, &settings.run, resources.device)?;
        let (data, kind) = (&settings.data, settings.run.precision.kind());
        Ok(Self {
            training: Turns::for_training(data, (settings.run.seed, kind), resources.clone())?,
            validation: Turns::for_validation(data, kind, resources)?,
            settings,
            trainable,
            validated: Vec::new(),
        })
    }

    /// The batches of validation: each view once, in a material and light of its own.
    fn make_validation(&mut self) -> Result<(), TrainError> {
        let count = self.settings.data.validation;
        let mut begin = self.validated.len() as u64 * VALIDATION_BATCH;
        while begin < count {
            let end = count.min(begin + VALIDATION_BATCH);
            let seed = stream(44, begin);
            let batch = self.validation.batch((begin, end), end - begin, seed)?;
            self.validated.push(batch);
            begin = end;
        }
        self.validation.close();
        Ok(())
    }
}

/// Unit normals, and the logarithm of their expected chord error.
fn predicted_normals(output: &Tensor) -> (Tensor, Tensor) {
    let normals = output.narrow(1, 0, 3);
    let length = (over_channels(&normals.square()) + 1e-8).sqrt();
    let log_chord = output.narrow(1, 3, 1).clamp(LOG_CHORD.0, LOG_CHORD.1);
    (&normals / &length, log_chord)
}

/// How far the logarithm of the albedo is off at each pixel and channel, 0 outside the masks. Each channel of a turn is in a
/// unit of its own, in which its mean error is 0.
fn albedo_errors(output: &Tensor, batch: &TurnBatch) -> Tensor {
    let means = batch.input.narrow(1, LOG_MEANS as i64, 3);
    let errors = (output + &means - &batch.log_albedo) * &batch.mask;
    let over = |of: &Tensor| of.sum_dim_intlist([2_i64, 3].as_slice(), true, None);
    let covered = over(&batch.mask).clamp_min(1.0);
    let units = over(&errors) / &covered;
    (&errors - &units) * &batch.mask
}

/// The mean amount of these errors.
fn albedo_error(errors: &Tensor, batch: &TurnBatch) -> Mean {
    let channels = errors.size()[1] as f64;
    let over = batch.mask.sum(None).clamp_min(1.0);
    let sum = errors.abs().sum(None);
    let value = &sum / &over / channels;
    Mean { value, over }
}

/// Minus the logarithm of the chord's likelihood, where it is distributed exponentially with the expected mean.
fn expected_error(normals: &Tensor, log_chord: &Tensor, batch: &TurnBatch) -> Mean {
    let found = normals.detach();
    let chord = over_channels(&(&found - &batch.normals).square()).sqrt();
    let each = &chord * (-log_chord).exp() + log_chord;
    let over = batch.mask.sum(None).clamp_min(1.0);
    Mean::new((&each * &batch.mask).sum(None), over)
}

impl TrainingTask for TurnNetworkTask {
    fn name(&self) -> &'static str {
        "turn"
    }

    fn inputs(&self) -> Result<String, TrainError> {
        Ok(self.training.library().identity())
    }

    fn left_out(&self) -> &[SkippedFile] {
        self.training.left_out()
    }

    fn trainable(&mut self) -> &mut Trainable {
        &mut self.trainable
    }

    fn join(&mut self, group: &ProcessGroup) -> Result<(), TrainError> {
        self.training
            .set_rank(group.rank(), self.settings.run.batch)
    }

    fn step(&mut self, step: u64) -> Result<StepLosses, TrainError> {
        let (run, data) = (&self.settings.run, &self.settings.data);
        let seed = stream(stream(run.seed, 43), step);
        let batch = self.training.batch(data.views_at(step), run.batch, seed)?;
        let output = self.trainable.model.forward(&batch.input)?;
        let (normals, log_chord) = predicted_normals(&output[0]);
        let mut terms = LossTerms::default();
        terms.add_mean("normals", 1.0, chord(&normals, &batch.normals, &batch.mask));
        let expected = expected_error(&normals, &log_chord, &batch);
        terms.add_mean("expected_error", EXPECTED_ERROR, expected);
        let albedo = albedo_error(&albedo_errors(&output[1], &batch), &batch);
        terms.add_mean("albedo", ALBEDO, albedo);
        Ok(StepLosses {
            terms,
            ..StepLosses::default()
        })
    }

    fn validate(&mut self) -> Result<Validation, TrainError> {
        self.make_validation()?;
        let model = self.trainable.average();
        let mut summary = ValidationSummary::default();
        for batch in &self.validated {
            no_grad(|| {
                let output = model.forward(&batch.input)?;
                let (normals, log_chord) = predicted_normals(&output[0]);
                summary.add(batch, &normals, &log_chord)?;
                summary.add_albedo(batch, &output[1])
            })?;
        }
        Ok(Validation {
            figures: summary.figures(),
            ..Validation::default()
        })
    }
}

/// Errors over the turns of a validation.
#[derive(Debug, Default)]
struct ValidationSummary {
    /// The mean error of each turn, degrees.
    means: Vec<f64>,
    /// The error of each pixel, and by how much it is expected to be off, degrees.
    pixels: Vec<(f32, f32)>,
    /// The relative squared error of each turn's albedo, in the best unit of each channel.
    albedo: Vec<f64>,
}

impl ValidationSummary {
    fn add(
        &mut self,
        batch: &TurnBatch,
        normals: &Tensor,
        log_chord: &Tensor,
    ) -> Result<(), TrainError> {
        for k in 0..batch.mask.size()[0] {
            let part = |of: &Tensor| of.narrow(0, k, 1);
            let mask = part(&batch.mask);
            let error = angular_degrees(&part(normals), &part(&batch.normals), &mask);
            self.means.push(f64::try_from(error)?);
            let inside = mask.gt(0.5);
            let dots = over_channels(&(part(normals) * part(&batch.normals))).clamp(-1.0, 1.0);
            let errors = dots.acos().rad2deg().masked_select(&inside);
            let chords = (part(log_chord).exp() * 0.5).clamp_max(1.0);
            let expected = (chords.asin().rad2deg() * 2.0).masked_select(&inside);
            let (errors, expected) = (
                Vec::<f32>::try_from(errors)?,
                Vec::<f32>::try_from(expected)?,
            );
            self.pixels.extend(errors.into_iter().zip(expected));
        }
        Ok(())
    }

    fn add_albedo(&mut self, batch: &TurnBatch, output: &Tensor) -> Result<(), TrainError> {
        let means = batch.input.narrow(1, LOG_MEANS as i64, 3);
        let within = |of: &Tensor| of.exp() * &batch.mask;
        let (found, right) = (within(&(output + &means)), within(&batch.log_albedo));
        let over = |of: &Tensor| of.sum_dim_intlist([2_i64, 3].as_slice(), true, None);
        let square = over(&found.square()).clamp_min(1e-12);
        let unit = over(&(&found * &right)) / &square;
        let apart = (&found * &unit - &right).square();
        let all = |of: &Tensor| of.sum_dim_intlist([1_i64, 2, 3].as_slice(), false, None);
        let error = all(&apart) / all(&right.square()).clamp_min(1e-12);
        self.albedo
            .extend(Vec::<f64>::try_from(error.to_kind(Kind::Double))?);
        Ok(())
    }

    fn figures(mut self) -> std::collections::BTreeMap<String, f64> {
        let count = self.means.len().max(1) as f64;
        let mean = self.means.iter().sum::<f64>() / count;
        let square = self.means.iter().map(|m| (m - mean).powi(2)).sum::<f64>();
        let mut figures = std::collections::BTreeMap::from([
            ("normals_deg".to_owned(), mean),
            ("standard_error".to_owned(), square.sqrt() / count),
            ("albedo".to_owned(), self.albedo.iter().sum::<f64>() / count),
        ]);
        for (limit, name) in WITHIN_DEG {
            let expected = self
                .pixels
                .iter()
                .filter(|(_, expected)| f64::from(*expected) <= limit);
            let (all, kept) = expected.fold((0.0, 0.0), |(all, kept), (error, _)| {
                let is_kept = f64::from(*error) <= limit;
                (all + 1.0, kept + f64::from(u8::from(is_kept)))
            });
            figures.insert(name.to_owned(), if all > 0.0 { kept / all } else { 1.0 });
        }
        self.pixels.sort_by(|a, b| a.0.total_cmp(&b.0));
        let median = self
            .pixels
            .get(self.pixels.len() / 2)
            .map_or(0.0, |pixel| pixel.0);
        figures.insert("median_deg".to_owned(), f64::from(median));
        figures
    }
}
