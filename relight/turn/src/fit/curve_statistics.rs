//! What a curve comes down to for a least-squares fit of its waves.

use rayon::prelude::*;

use crate::model::harmonics::{WAVES, WaveTerm};
use crate::model::shading::PixelWaves;
use crate::observe::curves::TurnCurves;

/// Products of two waves.
pub(crate) const PAIRS: usize = WAVES * (WAVES + 1) / 2;

/// Parameters of the least-squares fit of a curve.
struct StatisticsParameters {
    /// Weight of the mean of a curve beside its variation, 0 to 1. By hand: shade in hollows and bounced light change
    /// the mean more than the harmonics.
    mean_weight: f64,
    /// Share of a curve's energy that counts as variation in any case, 0 to 1. Numerical: it keeps residuals of even
    /// curves finite.
    variation_floor: f64,
}

const PARAMETERS: StatisticsParameters = StatisticsParameters {
    mean_weight: 0.1,
    variation_floor: 0.01,
};

/// The sums that the fit of a pixel needs: with weights w, waves b and values v, those of w b v, of w b b and of
/// w v v for each channel, where the mean of the curve counts by `mean_weight`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moments {
    right: [[f64; WAVES]; 3],
    products: [[f64; PAIRS]; 3],
    energy: [f64; 3],
    /// One over the energy of the curve's variation: what a residual is measured by.
    unit: f64,
}

/// Products of [`PixelWaves`] with themselves and each other, as [`Moments`] take them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct WaveProducts {
    body: [[f64; PAIRS]; 3],
    /// How many products of the body there are.
    count: usize,
    /// Of both, and of the gloss with itself; none without gloss.
    gloss: Option<[[[f64; PAIRS]; 2]; 3]>,
}

/// The place of the product of waves `i` and `j`.
const fn pair(i: usize, j: usize) -> usize {
    let (low, high) = if i < j { (i, j) } else { (j, i) };
    high * (high + 1) / 2 + low
}

impl WaveProducts {
    pub(crate) fn of(waves: &PixelWaves) -> Self {
        let mut products = Self {
            body: [[0.0; PAIRS]; 3],
            count: waves.count * (waves.count + 1) / 2,
            gloss: None,
        };
        for (products, own) in products.body.iter_mut().zip(&waves.body) {
            symmetric(products, &own[..waves.count], &own[..waves.count]);
        }
        if waves.gloss != [[0.0; WAVES]; 3] {
            products.gloss = Some([0, 1, 2].map(|channel| {
                let gloss = &waves.gloss[channel];
                let mut both = [[0.0; PAIRS]; 2];
                symmetric(&mut both[0], &waves.body[channel], gloss);
                symmetric(&mut both[1], gloss, gloss);
                both
            }));
        }
        products
    }
}

/// The factors of each pair in the product of two lists of waves.
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

/// What a channel's curve has to do with a pixel's waves: products of the body's waves with what the gloss leaves of the curve,
/// of the body's waves with themselves, and the energy that the gloss leaves.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Share {
    along: f64,
    own: f64,
    rest: f64,
}

impl Share {
    /// The albedo that is drawn to another one, by this much beside what the curve says.
    fn drawn(self, to: f64, by: f64) -> f64 {
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

    /// What the best albedo leaves.
    fn left(self) -> f64 {
        let albedo = self.albedo();
        self.rest - albedo * (2.0 * self.along - albedo * self.own)
    }
}

impl Moments {
    /// Those of a pixel; `trust` says for each part of the turn how far it is to be believed, 0 to 1.
    pub(crate) fn new(curves: &TurnCurves, pixel: usize, trust: Option<&[f32]>) -> Self {
        let mut moments = Self {
            right: [[0.0; WAVES]; 3],
            products: [[0.0; PAIRS]; 3],
            energy: [0.0; 3],
            unit: 0.0,
        };
        let parts = curves.values(pixel).iter().zip(curves.weights(pixel));
        for (part, (value, weight)) in parts.enumerate() {
            let trust = trust.map_or(1.0, |trust| f64::from(trust[part]));
            let waves = &curves.waves()[part];
            for channel in 0..3 {
                let weight = f64::from(weight[channel]) * trust;
                if weight > 0.0 {
                    moments.add(channel, weight, f64::from(value[channel]), waves);
                }
            }
        }
        moments.mixed()
    }

    fn add(&mut self, channel: usize, weight: f64, value: f64, waves: &[f64; WAVES]) {
        self.energy[channel] += weight * value * value;
        let mut at = 0;
        for j in 0..WAVES {
            self.right[channel][j] += weight * value * waves[j];
            let weighted = weight * waves[j];
            for wave in &waves[..=j] {
                self.products[channel][at] += weighted * wave;
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
            // What the mean contributes, by Schur's complement of the constant.
            let part = 1.0 - PARAMETERS.mean_weight;
            let mean = right[0] / count;
            let centred = self.energy[channel] - mean * right[0];
            variation += centred.max(0.0) + PARAMETERS.variation_floor * self.energy[channel];
            self.energy[channel] -= part * mean * right[0];
            for j in 0..WAVES {
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

    /// One over the energy of the curve's variation.
    pub(crate) const fn unit(&self) -> f64 {
        self.unit
    }

    fn share(&self, channel: usize, waves: &PixelWaves, products: &WaveProducts) -> Share {
        let own = &self.products[channel];
        let mut share = Share {
            along: sum_of_products(&self.right[channel], &waves.body[channel][..waves.count]),
            own: sum_of_products(own, &products.body[channel][..products.count]),
            rest: self.energy[channel],
        };
        if let Some(gloss) = &products.gloss {
            let [both, gloss] = &gloss[channel];
            share.along -= sum_of_products(own, both);
            share.rest += sum_of_products(own, gloss)
                - 2.0 * sum_of_products(&self.right[channel], &waves.gloss[channel]);
        }
        share
    }

    /// What the best albedo leaves of the curve, over the energy of its variation.
    pub(crate) fn residual(&self, waves: &PixelWaves, products: &WaveProducts) -> f64 {
        let rest: f64 = (0..3)
            .map(|channel| self.share(channel, waves, products).left())
            .sum();
        (rest * self.unit).max(0.0)
    }

    /// The albedo that explains the curve best.
    pub(crate) fn albedo(&self, waves: &PixelWaves) -> [f64; 3] {
        let products = WaveProducts::of(waves);
        [0, 1, 2].map(|channel| self.share(channel, waves, &products).albedo())
    }

    /// The albedo that explains the curve best, drawn to one from which albedos of an object are `spread` away: as far as what is
    /// left of the curve, taken for noise of `freedom` degrees of freedom, lets it be any other.
    pub(crate) fn drawn_albedo(
        &self,
        waves: &PixelWaves,
        (to, spread): ([f64; 3], [f64; 3]),
        freedom: f64,
    ) -> [f64; 3] {
        let products = WaveProducts::of(waves);
        [0, 1, 2].map(|channel| {
            let share = self.share(channel, waves, &products);
            let noise = share.left().max(0.0) / freedom;
            let by = noise / spread[channel].powi(2).max(1e-12);
            share.drawn(to[channel], by)
        })
    }

    /// The products of each wave with a list of waves.
    pub(crate) fn times(&self, channel: usize, waves: &[f64; WAVES]) -> [f64; WAVES] {
        let mut all = [0.0; WAVES];
        let mut at = 0;
        for j in 0..WAVES {
            for i in 0..j {
                let product = self.products[channel][at];
                all[i] += product * waves[j];
                all[j] += product * waves[i];
                at += 1;
            }
            all[j] += self.products[channel][at] * waves[j];
            at += 1;
        }
        all
    }

    /// The products of each wave with what such waves leave of the curve.
    pub(crate) fn rest(&self, channel: usize, waves: &[f64; WAVES]) -> [f64; WAVES] {
        let seen = self.times(channel, waves);
        std::array::from_fn(|i| self.right[channel][i] - seen[i])
    }

    /// The energy of a channel's curve.
    pub(crate) const fn energy(&self, channel: usize) -> f64 {
        self.energy[channel]
    }

    /// How much of it such waves leave.
    pub(crate) fn left(&self, channel: usize, waves: &[f64; WAVES]) -> f64 {
        let rest = self.rest(channel, waves);
        self.energy[channel]
            - sum_of_products(waves, &self.right[channel])
            - sum_of_products(waves, &rest)
    }

    /// The product of two terms of a light.
    pub(crate) fn term_product(&self, channel: usize, a: &WaveTerm, b: &WaveTerm) -> f64 {
        let own = &self.products[channel];
        let at = |i: usize, j: usize| own[pair(a.wave + i, b.wave + j)];
        a.parts[0] * (b.parts[0] * at(0, 0) + b.parts[1] * at(0, 1))
            + a.parts[1] * (b.parts[0] * at(1, 0) + b.parts[1] * at(1, 1))
    }

    /// The product of a term with the curve.
    pub(crate) fn term_along(&self, channel: usize, term: &WaveTerm) -> f64 {
        let right = &self.right[channel][term.wave..];
        term.parts[0] * right[0] + term.parts[1] * right[1]
    }

    /// The constant wave's share of the curve, channel by channel: its mean light.
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
pub(crate) fn sum_of_products(a: &[f64], b: &[f64]) -> f64 {
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

pub(crate) fn all_moments(curves: &TurnCurves) -> Vec<Moments> {
    (0..curves.pixels())
        .into_par_iter()
        .map(|pixel| Moments::new(curves, pixel, None))
        .collect()
}
