//! The mean of each pixel's surroundings.

use relight_core::image::{Extent, Planes};

/// How far the surroundings reach, in standard deviations. Numerical.
const REACH: f32 = 3.3;

/// The mean of each pixel's surroundings, weighted as a Gaussian of this standard deviation, pixels.
pub(crate) fn smoothed<const C: usize>(map: &Planes<C>, deviation: f32) -> Planes<C> {
    let Extent { width, height } = map.extent();
    let reach = (REACH * deviation).ceil() as i64;
    let weights: Vec<f32> = (-reach..=reach)
        .map(|step| (-0.5 * (step as f32 / deviation).powi(2)).exp())
        .collect();
    let all: f32 = weights.iter().sum();
    let along = |source: &Planes<C>, across: bool| {
        Planes::from_fn(source.extent(), |x, y| {
            let mut sum = [0.0; C];
            for (step, weight) in (-reach..=reach).zip(&weights) {
                let line =
                    |at: usize, size: usize| (at as i64 + step).clamp(0, size as i64 - 1) as usize;
                let [x, y] = if across {
                    [line(x, width), y]
                } else {
                    [x, line(y, height)]
                };
                for (sum, value) in sum.iter_mut().zip(source.pixel(x, y)) {
                    *sum += weight * value;
                }
            }
            sum.map(|sum| sum / all)
        })
    };
    along(&along(map, true), false)
}
