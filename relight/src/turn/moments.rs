//! What a curve comes down to for a least-squares fit of five waves.

use super::TurnCurves;
use super::light::WAVES;

/// Products of two of the five waves.
pub(super) const PAIRS: usize = WAVES * (WAVES + 1) / 2;
/// How much the mean of a curve counts beside how it varies: shade in hollows and bounced light change the
/// mean more than they change the harmonics.
const MEAN_SHARE: f64 = 0.1;
/// Part of a curve's energy that counts as variation in any case.
const FLOOR: f64 = 0.01;

/// The sums that the fit of a pixel needs: with weights w, waves b and values v, those of w b v, of w b b and of
/// w v v for each channel, where the mean of the curve counts by [`MEAN_SHARE`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Moments {
    right: [[f64; WAVES]; 3],
    products: [[f64; PAIRS]; 3],
    energy: [f64; 3],
    /// One over the energy of the curve's variation: what a residual is measured by.
    unit: f64,
}

/// The place of the product of waves `i` and `j`.
const fn pair(i: usize, j: usize) -> usize {
    let (low, high) = if i < j { (i, j) } else { (j, i) };
    low * WAVES - low * (low + 1) / 2 + high
}

/// The products of five factors with each other, those of different ones twice.
pub(super) fn squares(waves: &[f64; WAVES]) -> [f64; PAIRS] {
    let mut products = [0.0; PAIRS];
    for i in 0..WAVES {
        for j in i..WAVES {
            let twice = if i == j { 1.0 } else { 2.0 };
            products[pair(i, j)] = twice * waves[i] * waves[j];
        }
    }
    products
}

impl Moments {
    /// Those of a pixel; `trust` says for each part of the turn how far it is to be believed, 0 to 1.
    pub(super) fn new(curves: &TurnCurves, pixel: usize, trust: Option<&[f32]>) -> Self {
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
        for i in 0..WAVES {
            self.right[channel][i] += weight * value * waves[i];
            for wave in &waves[i..] {
                self.products[channel][at] += weight * waves[i] * wave;
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
            let part = 1.0 - MEAN_SHARE;
            let mean = right[0] / count;
            let centred = self.energy[channel] - mean * right[0];
            variation += centred.max(0.0) + FLOOR * self.energy[channel];
            self.energy[channel] -= part * mean * right[0];
            for i in 0..WAVES {
                self.right[channel][i] -= part * products[i] * mean;
                for j in i..WAVES {
                    let shared = products[i] * products[j] / count;
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
    pub(super) fn is_dark(&self) -> bool {
        self.unit == 0.0
    }

    /// What the best albedo leaves of the curve under an irradiance of these waves, over the energy of its
    /// variation. The squares are those of the waves.
    pub(super) fn residual(&self, waves: &[[f64; WAVES]; 3], squares: &[[f64; PAIRS]; 3]) -> f64 {
        let mut rest = 0.0;
        for channel in 0..3 {
            let along = dot(&self.right[channel], &waves[channel]).max(0.0);
            let own = dot(&self.products[channel], &squares[channel]);
            let explained = if own > 1e-12 {
                along * along / own
            } else {
                0.0
            };
            rest += self.energy[channel] - explained;
        }
        (rest * self.unit).max(0.0)
    }

    /// The albedo that explains the curve best under an irradiance of these waves.
    pub(super) fn albedo(&self, waves: &[[f64; WAVES]; 3]) -> [f64; 3] {
        [0, 1, 2].map(|channel| {
            let along = dot(&self.right[channel], &waves[channel]).max(0.0);
            let own = dot(&self.products[channel], &squares(&waves[channel]));
            if own > 1e-12 { along / own } else { 0.0 }
        })
    }

    /// The product of two lists of waves.
    pub(super) fn product(&self, channel: usize, a: &[f64; WAVES], b: &[f64; WAVES]) -> f64 {
        let mut sum = 0.0;
        for i in 0..WAVES {
            if a[i] == 0.0 {
                continue;
            }
            for j in 0..WAVES {
                sum += a[i] * b[j] * self.products[channel][pair(i, j)];
            }
        }
        sum
    }

    /// The product of waves with the curve.
    pub(super) fn along(&self, channel: usize, waves: &[f64; WAVES]) -> f64 {
        dot(&self.right[channel], waves)
    }

    /// The constant wave's share of the curve, channel by channel: its mean light.
    pub(super) fn mean(curves: &TurnCurves, pixel: usize) -> [f64; 3] {
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

fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
