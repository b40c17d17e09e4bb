//! The sufficient statistics of a curve for a least-squares fit of its Fourier coefficients.

use rayon::prelude::*;

use crate::model::harmonics::{COEFFICIENTS, HarmonicTerm};
use crate::model::shading::PixelHarmonics;
use crate::observe::curves::TurnCurves;

/// Products of two harmonics.
const PAIRS: usize = COEFFICIENTS * (COEFFICIENTS + 1) / 2;

/// Weight of the mean of a curve beside its variation, 0 to 1. By hand: shade in hollows and bounced light change
/// the mean more than the harmonics.
const MEAN_WEIGHT: f64 = 0.1;
/// Share of a curve's energy that counts as variation in any case, 0 to 1. Numerical: it keeps residuals of even
/// curves finite.
const VARIATION_FLOOR: f64 = 0.01;

/// The normal equations of a pixel: with weights w, harmonics b and values v, the sums of w b v, of w b b and of
/// w v v for each channel, where the mean of the curve counts by [`MEAN_WEIGHT`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CurveStatistics {
    right: [[f64; COEFFICIENTS]; 3],
    products: [[f64; PAIRS]; 3],
    energy: [f64; 3],
    /// One over the energy of the curve's variation: what a residual is measured by.
    unit: f64,
}

/// The place of the product of harmonics `i` and `j`.
const fn pair(i: usize, j: usize) -> usize {
    let (low, high) = if i < j { (i, j) } else { (j, i) };
    high * (high + 1) / 2 + low
}

/// A linear problem for a small rotation of a pixel's normal: sums over all channels, over the energy of the curve's variation.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RotationEquations {
    /// Products of the changes by a rotation about each axis: the lower triangle, row by row.
    pub(crate) products: [f64; 6],
    /// Products of the changes with the residual.
    pub(crate) right: [f64; 3],
    /// The residual with the albedo that fits the curve best.
    pub(crate) residual: f64,
}

impl CurveStatistics {
    /// Those of a pixel.
    pub(crate) fn new(curves: &TurnCurves, pixel: usize) -> Self {
        let mut statistics = Self {
            right: [[0.0; COEFFICIENTS]; 3],
            products: [[0.0; PAIRS]; 3],
            energy: [0.0; 3],
            unit: 0.0,
        };
        let parts = curves.values(pixel).iter().zip(curves.weights(pixel));
        for (part, (value, weight)) in parts.enumerate() {
            let harmonics = &curves.harmonics()[part];
            for channel in 0..3 {
                let weight = f64::from(weight[channel]);
                if weight > 0.0 {
                    statistics.add(channel, weight, f64::from(value[channel]), harmonics);
                }
            }
        }
        statistics.mixed()
    }

    fn add(&mut self, channel: usize, weight: f64, value: f64, harmonics: &[f64; COEFFICIENTS]) {
        self.energy[channel] += weight * value * value;
        let mut at = 0;
        for j in 0..COEFFICIENTS {
            self.right[channel][j] += weight * value * harmonics[j];
            let weighted = weight * harmonics[j];
            for coefficient in &harmonics[..=j] {
                self.products[channel][at] += weighted * coefficient;
                at += 1;
            }
        }
    }

    /// The sums with the mean's smaller share.
    fn mixed(mut self) -> Self {
        let mut variation = 0.0;
        for channel in 0..3 {
            let products = self.products[channel];
            let (right, count) = (self.right[channel], products[0]);
            if count <= 0.0 {
                continue;
            }
            // What the mean contributes, by the Schur complement of the constant.
            let part = 1.0 - MEAN_WEIGHT;
            let mean = right[0] / count;
            let centred = self.energy[channel] - mean * right[0];
            variation += centred.max(0.0) + VARIATION_FLOOR * self.energy[channel];
            self.energy[channel] -= part * mean * right[0];
            for j in 0..COEFFICIENTS {
                let first = products[pair(0, j)];
                self.right[channel][j] -= part * first * mean;
                for i in 0..=j {
                    let shared = products[pair(0, i)] * first / count;
                    self.products[channel][pair(i, j)] -= part * shared;
                }
            }
        }
        self.unit = if variation > 0.0 {
            1.0 / variation
        } else {
            0.0
        };
        self
    }

    /// The residual of the best albedo, over the energy of the curve's variation.
    pub(crate) fn residual(&self, harmonics: &PixelHarmonics) -> f64 {
        let albedo = self.albedo(harmonics);
        let rest: f64 = (0..3)
            .map(|channel| {
                let shown = harmonics[channel].map(|value| albedo[channel] * value);
                self.residual_energy(channel, &shown)
            })
            .sum();
        (rest * self.unit).max(0.0)
    }

    /// The albedo that fits the curve best.
    pub(crate) fn albedo(&self, harmonics: &PixelHarmonics) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let harmonics = &harmonics[channel];
            let own = sum_of_products(harmonics, &self.times(channel, harmonics));
            if own > 1e-12 {
                (sum_of_products(harmonics, &self.right[channel]) / own).max(0.0)
            } else {
                0.0
            }
        })
    }

    /// How the curve changes by a small rotation of the normal, from what it shows and from what it shows after `step` radians about
    /// each axis. The albedo follows the normal.
    pub(crate) fn rotation_equations(
        &self,
        shown: &PixelHarmonics,
        turned: &[PixelHarmonics; 3],
        step: f64,
    ) -> RotationEquations {
        let mut equations = RotationEquations {
            residual: self.residual(shown),
            ..RotationEquations::default()
        };
        for (channel, albedo) in self.albedo(shown).into_iter().enumerate() {
            let base = &shown[channel];
            let weighted = self.times(channel, base);
            let own = sum_of_products(base, &weighted);
            if own <= 1e-12 {
                continue;
            }
            let rest: [f64; COEFFICIENTS] =
                std::array::from_fn(|i| self.right[channel][i] - albedo * weighted[i]);
            let changes = turned.each_ref().map(|turned| -> [f64; COEFFICIENTS] {
                let change: [f64; COEFFICIENTS] =
                    std::array::from_fn(|i| albedo * (turned[channel][i] - base[i]) / step);
                let along = sum_of_products(&change, &weighted) / own;
                std::array::from_fn(|i| change[i] - along * base[i])
            });
            let mut at = 0;
            for (i, change) in changes.iter().enumerate() {
                let weighted = self.times(channel, change);
                equations.right[i] += self.unit * sum_of_products(change, &rest);
                for other in &changes[..=i] {
                    equations.products[at] += self.unit * sum_of_products(other, &weighted);
                    at += 1;
                }
            }
        }
        equations
    }

    /// The products of harmonics with each other, times these.
    fn times(&self, channel: usize, harmonics: &[f64; COEFFICIENTS]) -> [f64; COEFFICIENTS] {
        let own = &self.products[channel];
        std::array::from_fn(|i| {
            (0..COEFFICIENTS)
                .map(|j| own[pair(i, j)] * harmonics[j])
                .sum()
        })
    }

    /// The energy of a channel's curve.
    pub(crate) const fn energy(&self, channel: usize) -> f64 {
        self.energy[channel]
    }

    /// The residual energy of such Fourier coefficients.
    pub(crate) fn residual_energy(&self, channel: usize, harmonics: &[f64; COEFFICIENTS]) -> f64 {
        let squares = sum_of_products(harmonics, &self.times(channel, harmonics));
        self.energy[channel] - 2.0 * sum_of_products(harmonics, &self.right[channel]) + squares
    }

    /// The product of two terms of a light.
    pub(crate) fn term_product(&self, channel: usize, a: &HarmonicTerm, b: &HarmonicTerm) -> f64 {
        let own = &self.products[channel];
        let at = |i: usize, j: usize| own[pair(a.coefficient + i, b.coefficient + j)];
        a.parts[0] * (b.parts[0] * at(0, 0) + b.parts[1] * at(0, 1))
            + a.parts[1] * (b.parts[0] * at(1, 0) + b.parts[1] * at(1, 1))
    }

    /// The product of a term with the curve.
    pub(crate) fn term_along(&self, channel: usize, term: &HarmonicTerm) -> f64 {
        let right = &self.right[channel][term.coefficient..];
        term.parts[0] * right[0] + term.parts[1] * right[1]
    }
}

fn sum_of_products(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(crate) fn all_statistics(curves: &TurnCurves) -> Vec<CurveStatistics> {
    (0..curves.pixels())
        .into_par_iter()
        .map(|pixel| CurveStatistics::new(curves, pixel))
        .collect()
}
