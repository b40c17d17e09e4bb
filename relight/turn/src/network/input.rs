//! The harmonics of a turn as the planes that the network of turns is given.
//!
//! Normals do not depend on a pixel's albedo, on the light's strength, or on the rotation of the environment light. So harmonics
//! are divided by the curve's mean, by their effective value over the object, and turned by the phase of the light, which
//! is read from the curves themselves.

use crate::network::limits::{
    COLOURED, DARK, HARMONICS, LOG_SCALE, MAX_LOG, MAX_RATIO, MAX_VALUE, MIN_MEAN, SMALL, STRONG,
};
use num_complex::Complex32;
use relight_photo::nets::{LOG_MEANS, TURN_INPUTS};

/// Terms of a curve.
const TERMS: usize = 2 * HARMONICS + 1;

/// A turn for the network: a square crop around the object.
#[derive(Debug, Clone, Copy)]
pub struct NetworkTurn<'a> {
    /// Width and height, pixels.
    pub side: usize,
    /// The covered pixels, ascending: row times side plus column.
    pub pixels: &'a [u32],
    /// Of each covered pixel, red, green and blue of the terms of its curve: its mean, then real and imaginary part of
    /// each of six harmonics.
    pub curves: &'a [[[f32; 3]; TERMS]],
    /// The camera over the table, radians.
    pub elevation: f32,
}

/// A harmonic of the three channels.
type Harmonic = [Complex32; 3];

/// The same direction, no longer than this.
fn up_to(value: Complex32, most: f32) -> Complex32 {
    value * (most / value.norm().max(1e-9)).min(1.0)
}

/// The planes of the network, [`TURN_INPUTS`] of side x side values, 0 outside the object.
pub fn network_input(turn: &NetworkTurn<'_>) -> Vec<f32> {
    let ratios = Ratios::new(turn);
    let turned = ratios.turned(ratios.phase());
    let mut planes = PlaneWriter::new(turn);
    let mut whole = Vec::new();
    for (m, harmonic) in turned.iter().enumerate() {
        let channels: &[usize] = if m < COLOURED { &[0, 1, 2] } else { &[3] };
        for &c in channels {
            let of = |k: usize| channel(&harmonic[k], c);
            let square = (0..turn.pixels.len())
                .map(|k| of(k).norm().powi(2))
                .sum::<f32>();
            let effective = (square / turn.pixels.len().max(1) as f32).sqrt() + SMALL;
            whole.push(effective.ln() / LOG_SCALE + 1.0);
            let value = |k: usize| up_to(of(k) * (1.0 / effective), MAX_VALUE);
            planes.push(|k| value(k).re);
            planes.push(|k| value(k).im);
        }
    }
    for harmonic in &turned[..STRONG] {
        planes.push(|k| channel(&harmonic[k], 3).re);
        planes.push(|k| channel(&harmonic[k], 3).im);
        for c in 0..3 {
            let mean = mean_of(harmonic, c);
            whole.extend([mean.re, mean.im]);
        }
    }
    debug_assert_eq!(planes.count(), LOG_MEANS);
    let logarithms = logarithms(&ratios.means);
    for c in [0, 1, 2] {
        planes.push(|k| logarithms[k][c]);
    }
    let side = turn.side as f32;
    planes.push(|_| 1.0);
    planes.push(|k| 2.0 * (turn.pixels[k] as usize % turn.side) as f32 / side - 1.0);
    planes.push(|k| 1.0 - 2.0 * (turn.pixels[k] as usize / turn.side) as f32 / side);
    planes.push(|_| 3.0 * turn.elevation.sin() - 1.0);
    for value in whole {
        planes.push(|_| value);
    }
    planes.finish()
}

/// The logarithms of the means of curves, each channel's over its own mean: what the network's albedo is added to.
pub(crate) fn log_means(means: &[[f32; 3]]) -> Vec<[f32; 3]> {
    logarithms(&over_mean(means).1)
}

fn logarithms(means: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let middle = [0, 1, 2].map(|c| {
        let sum: f32 = means.iter().map(|mean| mean[c].ln()).sum();
        sum / means.len().max(1) as f32
    });
    let most = MAX_LOG;
    let one = |mean: &[f32; 3]| [0, 1, 2].map(|c| (mean[c].ln() - middle[c]).clamp(-most, most));
    means.iter().map(one).collect()
}

/// The mean of each channel over the object, and the means of the curves in these.
fn over_mean(means: &[[f32; 3]]) -> ([f32; 3], Vec<[f32; 3]>) {
    let count = means.len().max(1) as f32;
    let of_all = [0, 1, 2].map(|c| {
        let sum: f32 = means.iter().map(|mean| mean[c].max(0.0)).sum();
        (sum / count).max(1e-9)
    });
    let one = |mean: &[f32; 3]| [0, 1, 2].map(|c| (mean[c] / of_all[c]).max(MIN_MEAN));
    (of_all, means.iter().map(one).collect())
}

/// A channel, or with the number 3 the mean of all.
fn channel(harmonic: &Harmonic, c: usize) -> Complex32 {
    if c < 3 {
        return harmonic[c];
    }
    let [r, g, b] = *harmonic;
    (r + g + b) * (1.0 / 3.0)
}

fn mean_of(harmonic: &[Harmonic], c: usize) -> Complex32 {
    let sum = harmonic
        .iter()
        .fold(Complex32::default(), |sum, one| sum + one[c]);
    sum * (1.0 / harmonic.len().max(1) as f32)
}

/// Harmonics over means.
struct Ratios {
    /// Of each pixel and channel, in means over the object and channel.
    means: Vec<[f32; 3]>,
    /// Harmonic by harmonic, pixel by pixel.
    harmonics: Vec<Vec<Harmonic>>,
}

impl Ratios {
    fn new(turn: &NetworkTurn<'_>) -> Self {
        let means: Vec<[f32; 3]> = turn.curves.iter().map(|curve| curve[0]).collect();
        let (of_all, means) = over_mean(&means);
        let ratio = |m: usize, k: usize| {
            [0, 1, 2].map(|c| {
                let curve = &turn.curves[k];
                let value = Complex32::new(curve[2 * m + 1][c], curve[2 * m + 2][c]);
                let over = means[k][c] * of_all[c];
                up_to(value * (1.0 / over), MAX_RATIO)
            })
        };
        let harmonics = (0..HARMONICS)
            .map(|m| (0..turn.curves.len()).map(|k| ratio(m, k)).collect())
            .collect();
        Self { means, harmonics }
    }

    /// The phase of the first harmonic over the object, radians.
    fn phase(&self) -> f32 {
        let weighted = self.harmonics[0]
            .iter()
            .zip(&self.means)
            .map(|(harmonic, mean)| {
                [0, 1, 2]
                    .map(|c| harmonic[c] * (mean[c] / (mean[c] + DARK)))
                    .into_iter()
                    .fold(Complex32::default(), |sum, one| sum + one)
            });
        let sum = weighted.fold(Complex32::default(), |sum, one| sum + one);
        sum.im.atan2(sum.re)
    }

    /// The harmonics with the environment light rotated back by this phase.
    fn turned(&self, phase: f32) -> Vec<Vec<Harmonic>> {
        let harmonics = self.harmonics.iter().enumerate();
        harmonics
            .map(|(m, pixels)| {
                let back = Complex32::cis(-phase * (m + 1) as f32);
                pixels
                    .iter()
                    .map(|one| one.map(|value| value * back))
                    .collect()
            })
            .collect()
    }
}

/// Planes that are filled one after the other.
struct PlaneWriter<'a> {
    turn: &'a NetworkTurn<'a>,
    values: Vec<f32>,
}

impl<'a> PlaneWriter<'a> {
    fn new(turn: &'a NetworkTurn<'a>) -> Self {
        let values = Vec::with_capacity(TURN_INPUTS * turn.side * turn.side);
        Self { turn, values }
    }

    /// Adds a plane by what it has at the covered pixels.
    fn push(&mut self, value: impl Fn(usize) -> f32) {
        let begin = self.values.len();
        self.values
            .resize(begin + self.turn.side * self.turn.side, 0.0);
        for (k, &pixel) in self.turn.pixels.iter().enumerate() {
            self.values[begin + pixel as usize] = value(k);
        }
    }

    fn count(&self) -> usize {
        self.values.len() / (self.turn.side * self.turn.side).max(1)
    }

    fn finish(self) -> Vec<f32> {
        debug_assert_eq!(
            self.values.len(),
            TURN_INPUTS * self.turn.side * self.turn.side
        );
        self.values
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 16;

    fn curves() -> (Vec<u32>, Vec<[[f32; 3]; TERMS]>) {
        let pixels: Vec<u32> = (0..256).filter(|pixel| pixel % 16 > 3).collect();
        let curve = |&pixel: &u32| {
            let mut curve = [[1.0; 3]; TERMS];
            for (term, values) in curve.iter_mut().enumerate().skip(1) {
                let wave = (pixel as f32 * 0.37 * term as f32).sin() / (term + 1) as f32;
                *values = [0.3 * wave + 0.1, 0.2 * wave + 0.1, 0.4 * wave];
            }
            curve
        };
        let curves = pixels.iter().map(curve).collect();
        (pixels, curves)
    }

    fn input(pixels: &[u32], curves: &[[[f32; 3]; TERMS]]) -> Vec<f32> {
        let turn = NetworkTurn {
            side: SIDE,
            pixels,
            curves,
            elevation: 0.3,
        };
        network_input(&turn)
    }

    /// The largest difference of two inputs.
    fn difference(a: &[f32], b: &[f32]) -> f32 {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max)
    }

    #[test]
    fn it_has_as_many_planes_as_the_network_wants_and_nothing_outside_the_object() {
        let (pixels, curves) = curves();
        let planes = input(&pixels, &curves);
        assert_eq!(planes.len(), TURN_INPUTS * SIDE * SIDE);
        for plane in planes.chunks(SIDE * SIDE) {
            assert!(
                (0..256)
                    .filter(|at| at % 16 <= 3)
                    .all(|at| plane[at] == 0.0)
            );
        }
    }

    #[test]
    fn it_does_not_depend_on_how_the_room_is_turned_nor_on_the_strength_of_the_light() {
        let (pixels, curves) = curves();
        let mut other = curves.clone();
        let angle = 1.234_f32;
        for curve in &mut other {
            for m in 1..=HARMONICS {
                let back = Complex32::cis(angle * m as f32);
                let [re, im] = [curve[2 * m - 1], curve[2 * m]];
                let turned = [0, 1, 2].map(|c| Complex32::new(re[c], im[c]) * back);
                curve[2 * m - 1] = turned.map(|value| value.re);
                curve[2 * m] = turned.map(|value| value.im);
            }
            curve
                .as_flattened_mut()
                .iter_mut()
                .for_each(|value| *value *= 7.0);
        }
        let (before, after) = (input(&pixels, &curves), input(&pixels, &other));
        assert!(difference(&before, &after) < 1e-3);
    }
}
