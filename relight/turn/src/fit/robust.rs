//! Which parts of the turn a pixel's fit may believe: not those in which it is in another's shadow or shows
//! a highlight.

use crate::fit::residuals::rest;
use crate::fit::search::PixelFit;
use crate::model::shading::Room;
use crate::observe::curves::TurnCurves;
use relight_core::statistics::upper_median;

/// Residuals of so many deviations count a quarter.
const WIDTH: f64 = 2.0;

/// The least deviation, as a part of the pixel's mean light.
const LEAST_DEVIATION: f64 = 0.01;

/// How far each part of the turn is to be believed for a pixel, 0 to 1: near 0 where the fit is far from what
/// is seen, measured by the median of how far it is elsewhere.
pub(crate) fn trust(curves: &TurnCurves, pixel: usize, fit: &PixelFit, room: &Room) -> Vec<f32> {
    let rest = rest(curves, pixel, fit, room);
    let sizes = rest.iter().flatten().map(|rest| rest.abs());
    let Some(median) = upper_median(sizes) else {
        return vec![1.0; rest.len()];
    };
    let deviation = 1.4826 * median + LEAST_DEVIATION;
    let trust = |rest: &Option<f64>| {
        let size = rest.unwrap_or(0.0) / (WIDTH * deviation);
        (1.0 / (1.0 + size * size).powi(2)) as f32
    };
    rest.iter().map(trust).collect()
}
