//! Which parts of the turn a pixel's fit may believe: not those in which it is in another's shadow or shows
//! a highlight.

use relight_core::statistics::upper_median;

use crate::fit::residuals::residuals;
use crate::fit::search::PixelFit;
use crate::model::shading::ShadingModel;
use crate::observe::curves::TurnCurves;

/// Residual whose weight is one quarter, in standard deviations. By hand.
const WIDTH: f64 = 2.0;
/// Least standard deviation, in parts of the pixel's mean light. By hand.
const LEAST_DEVIATION: f64 = 0.01;

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
    let deviation = 1.4826 * median + LEAST_DEVIATION;
    let robust_weights = |residuals: &Option<f64>| {
        let size = residuals.unwrap_or(0.0) / (WIDTH * deviation);
        (1.0 / (1.0 + size * size).powi(2)) as f32
    };
    residuals.iter().map(robust_weights).collect()
}
