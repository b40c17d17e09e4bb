//! The residual of a pixel's curve, and the parts of the turn that its fit may use: not those in which it lies in
//! shadow or shows a highlight.

use relit_data::statistics::upper_median;

use crate::fit::curve_statistics::CurveStatistics;
use crate::fit::search::PixelFit;
use crate::model::harmonics::COEFFICIENTS;
use crate::model::shading::{PixelHarmonics, ShadingModel};
use crate::observe::curves::TurnCurves;

/// Least share of the observed light that the model is assumed to fit, 0 to 1. By hand.
const MIN_MODEL: f64 = 0.1;

/// Residual whose weight is one quarter, in standard deviations. By hand.
const WIDTH: f64 = 2.0;
/// Least standard deviation, in parts of the pixel's mean light. By hand.
const MIN_DEVIATION: f64 = 0.01;

/// The unit of a pixel's residual: the model's mean over the turn, or a tenth of what is
/// seen, if that is more.
fn reference(curves: &TurnCurves, pixel: usize, fit: &PixelFit, model: &ShadingModel) -> f64 {
    let harmonics = model.harmonics(fit.normal);
    let predicted: f64 = (0..3).map(|c| fit.albedo[c] * harmonics.base[c][0]).sum();
    let seen: f64 = CurveStatistics::mean(curves, pixel).iter().sum();
    (predicted.max(MIN_MODEL * seen) / 3.0).max(1e-6)
}

/// How much more light than the fit's each part of the turn has, the mean of the channels, over the
/// [`reference`]; `None` if all channels are clipped.
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

/// The robust weight of each part of the turn for a pixel, 0 to 1: near 0 where the fit is far from what
/// is seen, measured by the median of how far it is elsewhere.
pub(crate) fn robust_weights(
    curves: &TurnCurves,
    pixel: usize,
    fit: &PixelFit,
    model: &ShadingModel,
) -> Vec<f32> {
    let residuals = residuals(curves, pixel, fit, model);
    let sizes = residuals.iter().flatten().map(|residuals| residuals.abs());
    let Some(median) = upper_median(sizes) else {
        return vec![1.0; residuals.len()];
    };
    let deviation = 1.4826 * median + MIN_DEVIATION;
    let robust_weights = |residuals: &Option<f64>| {
        let size = residuals.unwrap_or(0.0) / (WIDTH * deviation);
        (1.0 / (1.0 + size * size).powi(2)) as f32
    };
    residuals.iter().map(robust_weights).collect()
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
