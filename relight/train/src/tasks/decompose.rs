//! Training of the decomposing network on synthetic samples: its predictions as maps, and its losses.

use tch::Tensor;

use crate::data::sample::TruthBatch;
use crate::engine::losses::{Mean, chord, gradient, relative_distance, scale_invariant, windowed};
use crate::engine::tensors::{grey, over_channels};
use crate::engine::terms::LossTerms;
use relight_photo::decompose::{HIGHLIGHT_OFFSET, LOG_LUMINANCE, LOG_SHADING, MIN_FACING};

/// Added to shading before its logarithm is taken.
const SHADING_FLOOR: f64 = 0.03;
/// Added to albedo before its logarithm is taken.
const ALBEDO_FLOOR: f64 = 0.02;
/// Added to shading before the picture is divided by it.
const DIVISOR_FLOOR: f64 = 0.02;
/// Highlights of this size count fully.
const FULL_HIGHLIGHT: f64 = 0.1;
/// How much more a full highlight counts than none: most pixels have none, and a prediction without any would do.
const HIGHLIGHT_EMPHASIS: f64 = 8.0;
/// Energy of a faint highlight, a pixel.
const FAINT_ENERGY: f64 = 1e-4;

/// Loss coefficients, those of the built-in weights: scale-invariant errors of shading and albedo; that of the picture over the
/// shading, against albedo, in parts of the others; the same errors in windows; steps from pixel to pixel of log shading and log
/// albedo; distance of the normals; mean error of the highlights; energy of that error; distance of the light.
const WHOLE: f64 = 1.5;
const QUOTIENT: f64 = 0.5;
const WINDOWS: f64 = 0.75;
const GRADIENT: f64 = 0.2;
const NORMALS: f64 = 1.0;
const HIGHLIGHT: f64 = 1.0;
const HIGHLIGHT_ENERGY: f64 = 0.2;
const LIGHT: f64 = 0.1;

/// The network's predictions as maps on tensors, `batch x channels x height x width`: what
/// [`relight_photo::decompose::NetworkInput::decode`] makes of them one by one.
#[derive(Debug)]
pub struct PredictedTensors {
    /// Unit normals.
    pub normals: Tensor,
    /// Albedo, 0..1.
    pub albedo: Tensor,
    /// Shading, 1 channel.
    pub shading: Tensor,
    /// Highlight in whites, 1 channel.
    pub highlight: Tensor,
    /// The light, `batch x 9` as [`relight_photo::decompose::PredictedLight`] has it; none of a network without that head.
    pub light: Option<Tensor>,
}

impl PredictedTensors {
    /// The maps for the network's input and its outputs.
    pub fn from_outputs(input: &Tensor, outputs: &[Tensor]) -> Self {
        Self {
            light: outputs.get(1).map(Tensor::shallow_clone),
            ..Self::new(input, &outputs[0])
        }
    }

    /// The maps for the network's input and its output `maps`.
    pub fn new(input: &Tensor, prediction: &Tensor) -> Self {
        let part = |from: i64, count: i64| prediction.narrow(1, from, count);
        let facing = part(2, 1).softplus() + f64::from(MIN_FACING);
        let normals = Tensor::cat(&[part(0, 2), facing], 1);
        let length = over_channels(&normals.square()).sqrt();
        let log_luminance = input.narrow(1, LOG_LUMINANCE as i64, 1) * 2.0 - 2.0;
        let log_shading = (part(7, 1) + part(8, 1).sigmoid() * &log_luminance)
            .clamp(f64::from(LOG_SHADING.0), f64::from(LOG_SHADING.1));
        Self {
            normals: &normals / &length,
            albedo: part(3, 3).sigmoid(),
            shading: log_shading.exp(),
            highlight: (part(6, 1) - f64::from(HIGHLIGHT_OFFSET)).softplus(),
            light: None,
        }
    }
}

/// The weighted losses of a batch.
pub(crate) fn decompose_losses(batch: &TruthBatch, prediction: &PredictedTensors) -> LossTerms {
    let mut terms = LossTerms::default();
    let mask = &batch.mask;
    let (albedo, found_albedo) = (grey(&batch.albedo), grey(&prediction.albedo));
    let diffuse = (&batch.picture - &batch.highlight).clamp_min(0.0);
    let quotient = grey(&diffuse) / (&prediction.shading + DIVISOR_FLOOR);

    let error = scale_invariant(&prediction.shading, &batch.shading, mask);
    terms.add("shading", WHOLE, error);
    let error = scale_invariant(&prediction.albedo, &batch.albedo, mask);
    terms.add("albedo", WHOLE, error);
    let error = scale_invariant(&quotient, &albedo, mask);
    terms.add("quotient", WHOLE * QUOTIENT, error);

    let height = mask.size()[2];
    let narrow = (height / 16).max(4);
    for (name, found, truth, part) in [
        ("shading_windows", &prediction.shading, &batch.shading, 1.0),
        ("albedo_windows", &found_albedo, &albedo, 1.0),
        ("quotient_windows", &quotient, &albedo, QUOTIENT),
    ] {
        let coefficient = WINDOWS * part;
        let near = windowed(found, truth, mask, narrow);
        let far = windowed(found, truth, mask, 3 * narrow);
        terms.add(name, coefficient, &near + &far * 0.5);
    }

    let log = |of: &Tensor, floor: f64| (of + floor).log();
    let steps = gradient(
        &log(&prediction.shading, SHADING_FLOOR),
        &log(&batch.shading, SHADING_FLOOR),
        mask,
    );
    for mean in steps {
        terms.add_mean("shading_steps", GRADIENT, mean);
    }
    let steps = gradient(
        &log(&found_albedo, ALBEDO_FLOOR),
        &log(&albedo, ALBEDO_FLOOR),
        mask,
    );
    for mean in steps {
        terms.add_mean("albedo_steps", GRADIENT * 0.5, mean);
    }
    let distance = chord(&prediction.normals, &batch.normals, mask);
    terms.add_mean("normals", NORMALS, distance);
    let highlight = highlight_error(&prediction.highlight, &batch.highlight, mask);
    terms.add_mean("highlight", HIGHLIGHT, highlight);
    let energy = highlight_energy_error(batch, prediction);
    terms.add_mean("highlight_energy", HIGHLIGHT_ENERGY, energy);
    if let Some(light) = &prediction.light {
        let distance = relative_distance(light, &batch.light);
        terms.add_mean("light", LIGHT, distance);
    }
    terms
}

/// Mean absolute error, in which highlights count more than their absence.
pub(crate) fn highlight_error(found: &Tensor, truth: &Tensor, mask: &Tensor) -> Mean {
    let emphasis =
        (truth.clamp(0.0, FULL_HIGHLIGHT) * (HIGHLIGHT_EMPHASIS / FULL_HIGHLIGHT) + 1.0) * mask;
    let error = (found - truth).abs() * &emphasis;
    Mean::new(error.sum(None), mask.sum(None).clamp_min(1.0))
}

/// Energy of the error as a part of the energy of the batch's highlights: 1 for a prediction without any. A batch
/// with hardly any highlight counts as if it had a faint one.
fn highlight_energy_error(batch: &TruthBatch, prediction: &PredictedTensors) -> Mean {
    let energy = |of: &Tensor| (of.square() * &batch.mask).sum(None);
    let faint = batch.mask.sum(None) * FAINT_ENERGY;
    let over = energy(&batch.highlight) + &faint;
    let error = energy(&(&prediction.highlight - &batch.highlight));
    Mean::new(error, over)
}
