//! What a shining surface shows of the environment light beside its diffuse part, as it acts on the curve of a pixel.

use std::sync::LazyLock;

use relight_core::light::{LightError, ShLight};

use crate::model::harmonics::{COEFFICIENTS, GLOSS_ORDER, HarmonicTerm};

/// Terms of a channel's gloss.
pub(crate) const GLOSS_TERMS: usize = (GLOSS_ORDER + 1) * (GLOSS_ORDER + 1);

/// Reflectance of a dielectric at normal incidence, 0 to 1; at a glancing angle it is 1. By convention, for an index of
/// refraction of 1.5.
const HEAD_ON: f64 = 0.04;

/// The environment light as the object's gloss shows it. A pixel whose normal is n reflects the viewer's direction to
/// r = 2 (n·v) n - v; over the table's angle t it shows, in the frame of the table, with q = r_x + i r_y,
///
/// `S(t) = F(n·v) Re Σ_lm s_lm P_lm(r_z) q^m e^(i m t)`.
///
/// F is the reflectance by Schlick's formula, `P_lm` the m-th derivative of Legendre's polynomial l, with the factor
/// that makes it a spherical harmonic. What the s_lm are of the environment light is a factor for each l: the blur of
/// the lobe. Of each channel, the terms of band l are Re s_l0, Re s_l1, Im s_l1, Re s_l2 and so on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct GlossLight {
    terms: [[f64; GLOSS_TERMS]; 3],
}

impl GlossLight {
    /// That of a Lambertian object.
    pub(crate) const NONE: Self = Self {
        terms: [[0.0; GLOSS_TERMS]; 3],
    };

    /// The gloss of these terms.
    pub(crate) const fn new(terms: [[f64; GLOSS_TERMS]; 3]) -> Self {
        Self { terms }
    }

    /// One a band of a light in the table's frame, up to [`GLOSS_ORDER`]: what gloss shows of it that blurs nothing.
    pub(crate) fn bands(light: &ShLight) -> Vec<Self> {
        let order = light.order().get().min(GLOSS_ORDER);
        let coefficients = light.coefficients();
        (0..=order)
            .map(|l| {
                let mut terms = [[0.0; GLOSS_TERMS]; 3];
                for at in l * l..(l + 1) * (l + 1) {
                    let (coefficient, sign) = of_term(l, at - l * l);
                    for (channel, terms) in terms.iter_mut().enumerate() {
                        terms[at] = sign * coefficients[coefficient][channel];
                    }
                }
                Self { terms }
            })
            .collect()
    }

    /// The light in the table's frame of which it would show this much if it blurred nothing.
    pub(crate) fn light(&self) -> Result<ShLight, LightError> {
        let mut coefficients = vec![[0.0; 3]; GLOSS_TERMS];
        for l in 0..=GLOSS_ORDER {
            for at in l * l..(l + 1) * (l + 1) {
                let (coefficient, sign) = of_term(l, at - l * l);
                coefficients[coefficient] = [0, 1, 2].map(|c| sign * self.terms[c][at]);
            }
        }
        ShLight::new(coefficients)
    }

    /// The first so many bands.
    pub(crate) fn within(mut self, bands: usize) -> Self {
        let count = (bands * bands).min(GLOSS_TERMS);
        for terms in &mut self.terms {
            terms[count..].fill(0.0);
        }
        self
    }

    /// The sum of others, each times a factor.
    pub(crate) fn sum(parts: &[Self], factors: &[f64]) -> Self {
        let mut sum = Self::NONE;
        for (part, factor) in parts.iter().zip(factors) {
            for (sum, part) in sum.terms.iter_mut().zip(&part.terms) {
                for (sum, part) in sum.iter_mut().zip(part) {
                    *sum += factor * part;
                }
            }
        }
        sum
    }

    /// The same with each channel times a factor.
    pub(crate) fn times(mut self, factors: [f64; 3]) -> Self {
        for (terms, factor) in self.terms.iter_mut().zip(factors) {
            terms.iter_mut().for_each(|term| *term *= factor);
        }
        self
    }

    /// The factor by which it is nearest to another.
    pub(crate) fn attenuation_of(&self, other: &Self) -> f64 {
        let dot = |a: &Self, b: &Self| -> f64 {
            let pairs = a.terms.iter().flatten().zip(b.terms.iter().flatten());
            pairs.map(|(a, b)| a * b).sum()
        };
        let own = dot(other, other);
        if own > 0.0 {
            dot(self, other) / own
        } else {
            0.0
        }
    }

    /// Whether it is that of a Lambertian object.
    pub(crate) fn is_none(&self) -> bool {
        *self == Self::NONE
    }

    /// What a pixel shows of it, as factors of the harmonics. `facing` is n·v, and `reflected` r in the table's frame.
    pub(crate) fn harmonics(&self, facing: f64, reflected: [f64; 3]) -> [[f64; COEFFICIENTS]; 3] {
        if self.is_none() {
            return [[0.0; COEFFICIENTS]; 3];
        }
        self.harmonics_of(&gloss_terms(facing, reflected))
    }

    /// The same for a pixel's terms.
    pub(crate) fn harmonics_of(
        &self,
        terms: &[HarmonicTerm; GLOSS_TERMS],
    ) -> [[f64; COEFFICIENTS]; 3] {
        let mut harmonics = [[0.0; COEFFICIENTS]; 3];
        for (at, term) in terms.iter().enumerate() {
            for (harmonics, terms) in harmonics.iter_mut().zip(&self.terms) {
                harmonics[term.coefficient] += terms[at] * term.parts[0];
                harmonics[term.coefficient + 1] += terms[at] * term.parts[1];
            }
        }
        harmonics
    }
}

/// Which coefficient of a light the k-th term of band l stands for, and with which sign.
const fn of_term(l: usize, k: usize) -> (usize, f64) {
    let middle = l * (l + 1);
    if k % 2 == 1 {
        (middle + k.div_ceil(2), 1.0)
    } else {
        (middle - k / 2, if k == 0 { 1.0 } else { -1.0 })
    }
}

/// The part of the light that is reflected, by Schlick's formula.
pub(crate) fn reflectance(facing: f64) -> f64 {
    HEAD_ON + (1.0 - HEAD_ON) * (1.0 - facing.clamp(0.0, 1.0)).powi(5)
}

/// What each term of the gloss contributes to the harmonics of a pixel.
pub(crate) fn gloss_terms(facing: f64, reflected: [f64; 3]) -> [HarmonicTerm; GLOSS_TERMS] {
    terms_of(reflectance(facing), reflected)
}

/// What white metal shows of a light, over the sum of its terms times the light's coefficients: as bright as a
/// Lambertian white surface in even light, π times it, and the terms are √(4π) times the harmonics.
pub(crate) const MIRROR: f64 = 0.886_226_925_452_758;

/// The same where all light is reflected, as by metal.
pub(crate) fn mirror_terms(reflected: [f64; 3]) -> [HarmonicTerm; GLOSS_TERMS] {
    terms_of(1.0, reflected)
}

fn terms_of(part: f64, [x, y, z]: [f64; 3]) -> [HarmonicTerm; GLOSS_TERMS] {
    let legendre = derivatives(z);
    let mut terms = [HarmonicTerm {
        coefficient: 0,
        parts: [0.0; 2],
    }; GLOSS_TERMS];
    let (mut re, mut im) = (1.0, 0.0);
    for m in 0..=GLOSS_ORDER {
        for l in m..=GLOSS_ORDER {
            let value = part * legendre[l][m];
            let [a, b] = [value * re, value * im];
            if m == 0 {
                terms[l * l].parts = [a, 0.0];
            } else {
                let coefficient = 2 * m - 1;
                terms[l * l + 2 * m - 1] = HarmonicTerm {
                    coefficient,
                    parts: [a, b],
                };
                terms[l * l + 2 * m] = HarmonicTerm {
                    coefficient,
                    parts: [-b, a],
                };
            }
        }
        (re, im) = (re * x - im * y, re * y + im * x);
    }
    terms
}

/// The m-th derivative of Legendre's polynomial l at z, for each l and m up to l, times its scale.
fn derivatives(z: f64) -> [[f64; GLOSS_ORDER + 1]; GLOSS_ORDER + 1] {
    let mut values = [[0.0; GLOSS_ORDER + 1]; GLOSS_ORDER + 1];
    // P_00 = 1, P_lm = (2 l - 1) P_(l-1)(m-1) + P_(l-2)m, and l P_l0 = (2 l - 1) z P_(l-1)0 - (l - 1) P_(l-2)0.
    values[0][0] = 1.0;
    for l in 1..=GLOSS_ORDER {
        let odd = (2 * l - 1) as f64;
        for m in 0..=l {
            let two_before = if l > 1 { values[l - 2][m] } else { 0.0 };
            values[l][m] = if m > 0 {
                odd * values[l - 1][m - 1] + two_before
            } else {
                (odd * z * values[l - 1][0] - (l - 1) as f64 * two_before) / l as f64
            };
        }
    }
    for (row, scales) in values.iter_mut().zip(SCALES.iter()) {
        for (value, scale) in row.iter_mut().zip(scales) {
            *value *= scale;
        }
    }
    values
}

/// The root of (2 l + 1) (l - m)! / (l + m)!, twice that for m above 0, for each l and m up to l.
static SCALES: LazyLock<[[f64; GLOSS_ORDER + 1]; GLOSS_ORDER + 1]> = LazyLock::new(|| {
    let mut scales = [[0.0; GLOSS_ORDER + 1]; GLOSS_ORDER + 1];
    for (l, row) in scales.iter_mut().enumerate() {
        for (m, scale) in row.iter_mut().enumerate().take(l + 1) {
            let ratio: f64 = (l - m + 1..=l + m).map(|k| k as f64).product();
            let twice = if m == 0 { 1.0 } else { 2.0 };
            *scale = (twice * (2 * l + 1) as f64 / ratio).sqrt();
        }
    }
    scales
});

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn terms_of_one_band_have_the_same_sum_of_squares_everywhere() {
        // The addition theorem: that sum is 2 l + 1 on the whole sphere, at every angle of the table.
        for direction in [[0.6, 0.48, 0.64], [0.0, -0.8, -0.6], [0.28, 0.96, 0.0]] {
            let terms = gloss_terms(1.0, direction);
            for l in 0..=GLOSS_ORDER {
                for angle in [0.0_f64, 1.3] {
                    let sum: f64 = terms[l * l..(l + 1) * (l + 1)]
                        .iter()
                        .map(|term| {
                            let m = term.coefficient.div_ceil(2) as f64;
                            let (sin, cos) = (m * angle).sin_cos();
                            (term.parts[0] * cos - term.parts[1] * sin).powi(2)
                        })
                        .sum();
                    let expected = HEAD_ON * HEAD_ON * (2 * l + 1) as f64;
                    assert!((sum / expected - 1.0).abs() < 1e-9, "{l}: {sum}");
                }
            }
        }
    }

    #[test]
    fn a_lambertian_object_shows_nothing_and_a_glancing_one_all() {
        assert_eq!(
            GlossLight::NONE.harmonics(0.5, [0.0, 0.6, 0.8]),
            [[0.0; COEFFICIENTS]; 3]
        );
        let mut terms = [[0.0; GLOSS_TERMS]; 3];
        terms[1][0] = 2.0;
        let gloss = GlossLight::new(terms);
        assert!((gloss.harmonics(0.0, [1.0, 0.0, 0.0])[1][0] - 2.0).abs() < 1e-12);
        assert!((gloss.harmonics(1.0, [1.0, 0.0, 0.0])[1][0] - 0.08).abs() < 1e-12);
    }
}
