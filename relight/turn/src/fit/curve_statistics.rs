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
/// w v v for each channel, where the mean of the curve counts by `mean_weight`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct CurveStatistics {
    right: [[f64; COEFFICIENTS]; 3],
    products: [[f64; PAIRS]; 3],
    energy: [f64; 3],
    /// One over the energy of the curve's variation: what a residual is measured by.
    unit: f64,
}

/// Products of [`PixelWaves`] with themselves and each other, as [`Moments`] take them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct HarmonicProducts {
    base: [[f64; PAIRS]; 3],
    /// Of both, and of the gloss with itself; none without gloss.
    gloss: Option<[[[f64; PAIRS]; 2]; 3]>,
}

/// The place of the product of harmonics `i` and `j`.
const fn pair(i: usize, j: usize) -> usize {
    let (low, high) = if i < j { (i, j) } else { (j, i) };
    high * (high + 1) / 2 + low
}

impl HarmonicProducts {
    pub(crate) fn from_harmonics(harmonics: &PixelHarmonics) -> Self {
        let mut products = Self {
            base: [[0.0; PAIRS]; 3],
            gloss: None,
        };
        for (products, own) in products.base.iter_mut().zip(&harmonics.base) {
            symmetric(products, own, own);
        }
        if harmonics.gloss != [[0.0; COEFFICIENTS]; 3] {
            products.gloss = Some([0, 1, 2].map(|channel| {
                let gloss = &harmonics.gloss[channel];
                let mut both = [[0.0; PAIRS]; 2];
                symmetric(&mut both[0], &harmonics.base[channel], gloss);
                symmetric(&mut both[1], gloss, gloss);
                both
            }));
        }
        products
    }
}

/// The factors of each pair in the product of two lists of harmonics.
fn symmetric(products: &mut [f64], a: &[f64], b: &[f64]) {
    let mut at = 0;
    for j in 0..a.len() {
        for i in 0..j {
            products[at] = a[i] * b[j] + a[j] * b[i];
            at += 1;
        }
        products[at] = a[j] * b[j];
        at += 1;
    }
}

/// The projection of a channel's curve on a pixel's harmonics: products of the base layer's harmonics with the residual
/// of the gloss, of the base layer's harmonics with themselves, and the energy of that residual.
#[derive(Debug, Clone, Copy)]
struct Projection {
    along: f64,
    own: f64,
    rest: f64,
}

impl Projection {
    /// The albedo, shrunk toward another one with this weight relative to the curve.
    fn shrunk(self, to: f64, by: f64) -> f64 {
        if self.own + by > 1e-12 {
            ((self.along + by * to) / (self.own + by)).max(0.0)
        } else {
            0.0
        }
    }

    fn albedo(self) -> f64 {
        if self.own > 1e-12 {
            (self.along / self.own).max(0.0)
        } else {
            0.0
        }
    }

    /// The residual of the best albedo.
    fn residual(self) -> f64 {
        let albedo = self.albedo();
        self.rest - albedo * (2.0 * self.along - albedo * self.own)
    }
}

impl CurveStatistics {
    /// Those of a pixel; `robust` has the robust weight of each part of the turn, 0 to 1.
    pub(crate) fn new(curves: &TurnCurves, pixel: usize, robust: Option<&[f32]>) -> Self {
        let mut statistics = Self {
            right: [[0.0; COEFFICIENTS]; 3],
            products: [[0.0; PAIRS]; 3],
            energy: [0.0; 3],
            unit: 0.0,
        };
        let parts = curves.values(pixel).iter().zip(curves.weights(pixel));
        for (part, (value, weight)) in parts.enumerate() {
            let robust = robust.map_or(1.0, |robust| f64::from(robust[part]));
            let harmonics = &curves.harmonics()[part];
            for channel in 0..3 {
                let weight = f64::from(weight[channel]) * robust;
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

    /// The moments with the mean's smaller share.
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

    /// Whether there is nothing to fit.
    pub(crate) fn is_dark(&self) -> bool {
        self.unit == 0.0
    }

    fn share(
        &self,
        channel: usize,
        harmonics: &PixelHarmonics,
        products: &HarmonicProducts,
    ) -> Projection {
        let own = &self.products[channel];
        let mut share = Projection {
            along: sum_of_products(&self.right[channel], &harmonics.base[channel]),
            own: sum_of_products(own, &products.base[channel]),
            rest: self.energy[channel],
        };
        if let Some(gloss) = &products.gloss {
            let [both, gloss] = &gloss[channel];
            share.along -= sum_of_products(own, both);
            share.rest += sum_of_products(own, gloss)
                - 2.0 * sum_of_products(&self.right[channel], &harmonics.gloss[channel]);
        }
        share
    }

    /// The residual of the best albedo, over the energy of the curve's variation.
    pub(crate) fn residual(&self, harmonics: &PixelHarmonics, products: &HarmonicProducts) -> f64 {
        let rest: f64 = (0..3)
            .map(|channel| self.share(channel, harmonics, products).residual())
            .sum();
        (rest * self.unit).max(0.0)
    }

    /// The albedo that fits the curve best.
    pub(crate) fn albedo(&self, harmonics: &PixelHarmonics) -> [f64; 3] {
        let products = HarmonicProducts::from_harmonics(harmonics);
        [0, 1, 2].map(|channel| self.share(channel, harmonics, &products).albedo())
    }

    /// The albedo that fits the curve best, shrunk toward one from which albedos of an object are `spread` away: as far
    /// as the curve's residual, as noise of `freedom` degrees of freedom, leaves it uncertain.
    pub(crate) fn shrunk_albedo(
        &self,
        harmonics: &PixelHarmonics,
        (to, spread): ([f64; 3], [f64; 3]),
        freedom: f64,
    ) -> [f64; 3] {
        let products = HarmonicProducts::from_harmonics(harmonics);
        [0, 1, 2].map(|channel| {
            let share = self.share(channel, harmonics, &products);
            let noise = share.residual().max(0.0) / freedom;
            let by = noise / spread[channel].powi(2).max(1e-12);
            share.shrunk(to[channel], by)
        })
    }

    /// The energy of a channel's curve.
    pub(crate) const fn energy(&self, channel: usize) -> f64 {
        self.energy[channel]
    }

    /// The residual energy of such Fourier coefficients.
    pub(crate) fn residual_energy(&self, channel: usize, harmonics: &[f64; COEFFICIENTS]) -> f64 {
        let mut products = [0.0; PAIRS];
        symmetric(&mut products, harmonics, harmonics);
        self.energy[channel] - 2.0 * sum_of_products(harmonics, &self.right[channel])
            + sum_of_products(&products, &self.products[channel])
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

    /// The mean light of a curve, channel by channel.
    pub(crate) fn mean(curves: &TurnCurves, pixel: usize) -> [f64; 3] {
        let (mut sum, mut weights) = ([0.0; 3], [0.0; 3]);
        for (value, weight) in curves.values(pixel).iter().zip(curves.weights(pixel)) {
            for channel in 0..3 {
                sum[channel] += f64::from(value[channel] * weight[channel]);
                weights[channel] += f64::from(weight[channel]);
            }
        }
        [0, 1, 2].map(|c| {
            if weights[c] > 0.0 {
                sum[c] / weights[c]
            } else {
                0.0
            }
        })
    }
}

/// The sum of products, as far as the shorter list goes: in four sums, which do not wait for each other.
fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
    let length = a.len().min(b.len());
    let (mut a, mut b) = (a[..length].chunks_exact(4), b[..length].chunks_exact(4));
    let mut sums = [0.0; 4];
    for (a, b) in a.by_ref().zip(b.by_ref()) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    let rest = a.remainder().iter().zip(b.remainder());
    sums.iter().sum::<f64>() + rest.map(|(a, b)| a * b).sum::<f64>()
}

pub(crate) fn all_statistics(curves: &TurnCurves) -> Vec<CurveStatistics> {
    (0..curves.pixels())
        .into_par_iter()
        .map(|pixel| CurveStatistics::new(curves, pixel, None))
        .collect()
}
