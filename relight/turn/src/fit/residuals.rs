//! What is left of a pixel's curve.

use crate::fit::curve_statistics::Moments;
use crate::fit::search::PixelFit;
use crate::model::harmonics::WAVES;
use crate::model::shading::{PixelWaves, Room};
use crate::observe::curves::TurnCurves;

/// Parameters of the residuals.
struct ResidualParameters {
    /// Least share of what is seen that the model is taken to explain, 0 to 1. By hand.
    least_model: f64,
}

const PARAMETERS: ResidualParameters = ResidualParameters { least_model: 0.1 };

/// The light by which what is left of a pixel is measured: the model's mean over the turn, or a tenth of what is
/// seen where that is more.
pub(crate) fn reference(curves: &TurnCurves, pixel: usize, fit: &PixelFit, room: &Room) -> f64 {
    let waves = room.waves(fit.normal);
    let model: f64 = (0..3).map(|c| fit.albedo[c] * waves.body[c][0]).sum();
    let seen: f64 = Moments::mean(curves, pixel).iter().sum();
    (model.max(PARAMETERS.least_model * seen) / 3.0).max(1e-6)
}

/// How much more light than the fit's each part of the turn has, the mean of the channels, over the
/// [`reference`]; none where all channels are clipped.
pub(crate) fn rest(
    curves: &TurnCurves,
    pixel: usize,
    fit: &PixelFit,
    room: &Room,
) -> Vec<Option<f64>> {
    let waves = room.waves(fit.normal);
    let reference = reference(curves, pixel, fit, room);
    let parts = curves.values(pixel).iter().zip(curves.weights(pixel));
    parts
        .zip(curves.waves())
        .map(|((value, weight), basis)| {
            let (mut sum, mut count) = (0.0, 0.0);
            for channel in (0..3).filter(|&c| weight[c] > 0.0) {
                let model = model(&waves, fit.albedo[channel], channel, basis);
                sum += f64::from(value[channel]) - model;
                count += 1.0;
            }
            (count > 0.0).then(|| sum / count / reference)
        })
        .collect()
}

/// What a channel shows where the waves' basis has these values.
fn model(waves: &PixelWaves, albedo: f64, channel: usize, basis: &[f64; WAVES]) -> f64 {
    let all =
        (0..WAVES).map(|i| (albedo * waves.body[channel][i] + waves.gloss[channel][i]) * basis[i]);
    all.sum()
}

/// What a pixel shows at an angle: its body at an albedo of 1, which of a matt one is its irradiance, and its gloss.
pub(crate) fn lit(room: &Room, normal: [f64; 3], basis: &[f64; WAVES]) -> [[f64; 3]; 2] {
    let waves = room.waves(normal);
    let dot = |waves: &[f64]| -> f64 { waves.iter().zip(basis).map(|(a, b)| a * b).sum() };
    [
        waves.body.each_ref().map(|waves| dot(waves)),
        waves.gloss.each_ref().map(|waves| dot(waves)),
    ]
}
