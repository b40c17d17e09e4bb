//! The residual of a pixel's curve.

use crate::fit::curve_statistics::CurveStatistics;
use crate::fit::search::PixelFit;
use crate::model::harmonics::COEFFICIENTS;
use crate::model::shading::{PixelHarmonics, ShadingModel};
use crate::observe::curves::TurnCurves;

/// Least share of what is seen that the model is taken to fit, 0 to 1. By hand.
const LEAST_MODEL: f64 = 0.1;

/// The light by which what is left of a pixel is measured: the model's mean over the turn, or a tenth of what is
/// seen where that is more.
pub(crate) fn reference(
    curves: &TurnCurves,
    pixel: usize,
    fit: &PixelFit,
    model: &ShadingModel,
) -> f64 {
    let harmonics = model.harmonics(fit.normal);
    let predicted: f64 = (0..3).map(|c| fit.albedo[c] * harmonics.base[c][0]).sum();
    let seen: f64 = CurveStatistics::mean(curves, pixel).iter().sum();
    (predicted.max(LEAST_MODEL * seen) / 3.0).max(1e-6)
}

/// How much more light than the fit's each part of the turn has, the mean of the channels, over the
/// [`reference`]; none where all channels are clipped.
pub(crate) fn residuals(
    curves: &TurnCurves,
    pixel: usize,
    fit: &PixelFit,
    model: &ShadingModel,
) -> Vec<Option<f64>> {
    let harmonics = model.harmonics(fit.normal);
    let reference = reference(curves, pixel, fit, model);
    let parts = curves.values(pixel).iter().zip(curves.weights(pixel));
    parts
        .zip(curves.harmonics())
        .map(|((value, weight), basis)| {
            let (mut sum, mut count) = (0.0, 0.0);
            for channel in (0..3).filter(|&c| weight[c] > 0.0) {
                let predicted = predicted(&harmonics, fit.albedo[channel], channel, basis);
                sum += f64::from(value[channel]) - predicted;
                count += 1.0;
            }
            (count > 0.0).then(|| sum / count / reference)
        })
        .collect()
}

/// What a channel shows where the harmonics' basis has these values.
fn predicted(
    harmonics: &PixelHarmonics,
    albedo: f64,
    channel: usize,
    basis: &[f64; COEFFICIENTS],
) -> f64 {
    let all = (0..COEFFICIENTS)
        .map(|i| (albedo * harmonics.base[channel][i] + harmonics.gloss[channel][i]) * basis[i]);
    all.sum()
}

/// What a pixel shows at an angle: its base layer at an albedo of 1, which of a Lambertian one is its irradiance, and
/// its gloss.
pub(crate) fn lit(
    model: &ShadingModel,
    normal: [f64; 3],
    basis: &[f64; COEFFICIENTS],
) -> [[f64; 3]; 2] {
    let harmonics = model.harmonics(normal);
    let dot = |harmonics: &[f64]| -> f64 { harmonics.iter().zip(basis).map(|(a, b)| a * b).sum() };
    [
        harmonics.base.each_ref().map(|harmonics| dot(harmonics)),
        harmonics.gloss.each_ref().map(|harmonics| dot(harmonics)),
    ]
}
