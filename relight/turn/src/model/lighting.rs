//! Light in the table's frame, as it acts on the curve of a pixel: along its normal, or along what it reflects.

use std::f64::consts::PI;
use std::sync::LazyLock;

use relight_core::light::{LightError, ShLight};
use relight_core::render::cosine_lobe;

use crate::model::harmonics::{COEFFICIENTS, GLOSS_ORDER, HarmonicTerm};

/// Terms of a channel's light.
pub(crate) const TERMS: usize = (GLOSS_ORDER + 1) * (GLOSS_ORDER + 1);

/// The first of them, which nearly determine a Lambertian surface.
pub(crate) const LAMBERTIAN_TERMS: usize = LAMBERTIAN_BANDS * LAMBERTIAN_BANDS;

const LAMBERTIAN_BANDS: usize = 3;

/// What white metal shows of a light, over the sum of its terms times the light's coefficients: as bright as a
/// Lambertian white surface in even light, π times it, and the terms are √(4π) times the harmonics.
pub(crate) const MIRROR: f64 = 0.886_226_925_452_758;

/// Light around an object, in the table's frame. In the direction r it shows over the table's angle t, with q = r_x + i r_y,
///
/// `S(t) = Re Σ_lm s_lm P_lm(r_z) q^m e^(i m t)`.
///
/// `P_lm` is the m-th derivative of Legendre's polynomial l, with the factor that makes it a spherical harmonic. A diffuse
/// surface shows it along its normal, blurred by the cosine; gloss along r = 2 (n·v) n - v, to which the viewer's direction is
/// reflected, blurred by the lobe: each a factor for each l. Of each channel, the terms of band l are Re s_l0, Re s_l1,
/// Im s_l1, Re s_l2 and so on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TableLight {
    terms: [[f64; TERMS]; 3],
}

impl TableLight {
    /// The light of these terms.
    pub(crate) const fn new(terms: [[f64; TERMS]; 3]) -> Self {
        Self { terms }
    }

    /// A light in the table's frame, up to [`GLOSS_ORDER`].
    pub(crate) fn from_light(light: &ShLight) -> Self {
        let mut terms = [[0.0; TERMS]; 3];
        for at in 0..light.coefficients().len().min(TERMS) {
            let (coefficient, sign) = of_term(at);
            for (channel, terms) in terms.iter_mut().enumerate() {
                terms[at] = sign * light.coefficients()[coefficient][channel];
            }
        }
        Self { terms }
    }

    /// The same as coefficients in the table's frame.
    ///
    /// # Errors
    /// If a term is not finite.
    pub(crate) fn light(&self) -> Result<ShLight, LightError> {
        let mut coefficients = vec![[0.0; 3]; TERMS];
        for at in 0..TERMS {
            let (coefficient, sign) = of_term(at);
            coefficients[coefficient] = [0, 1, 2].map(|c| sign * self.terms[c][at]);
        }
        ShLight::new(coefficients)
    }

    /// The same with the terms of each band and channel times a factor.
    pub(crate) fn scaled(mut self, factor: impl Fn(usize, usize) -> f64) -> Self {
        for (channel, terms) in self.terms.iter_mut().enumerate() {
            for (at, term) in terms.iter_mut().enumerate() {
                *term *= factor(at.isqrt(), channel);
            }
        }
        self
    }

    /// What a white Lambertian surface shows of the light along its normal: its irradiance.
    pub(crate) fn irradiance(self) -> Self {
        self.scaled(|l, _| MIRROR * cosine_lobe(l) / PI)
    }

    /// The light that gives this irradiance on a white Lambertian surface, in the bands that it shows well.
    pub(crate) fn light_of_irradiance(self) -> Self {
        self.scaled(|l, _| {
            if l < LAMBERTIAN_BANDS {
                PI / (MIRROR * cosine_lobe(l))
            } else {
                0.0
            }
        })
    }

    /// What a pixel of these terms shows of it, as factors of 1, cos t, -sin t, cos 2t, -sin 2t and so on.
    pub(crate) fn harmonics(&self, terms: &[HarmonicTerm]) -> [[f64; COEFFICIENTS]; 3] {
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

/// Which coefficient of a light a term stands for, and with which sign.
const fn of_term(at: usize) -> (usize, f64) {
    let l = at.isqrt();
    let (middle, k) = (l * (l + 1), at - l * l);
    if k % 2 == 1 {
        (middle + k.div_ceil(2), 1.0)
    } else {
        (middle - k / 2, if k == 0 { 1.0 } else { -1.0 })
    }
}

/// What each term of a light contributes to the harmonics of a pixel that shows it along a direction of the table's frame.
pub(crate) fn terms_along([x, y, z]: [f64; 3]) -> [HarmonicTerm; TERMS] {
    let legendre = derivatives(z);
    let mut terms = [HarmonicTerm {
        coefficient: 0,
        parts: [0.0; 2],
    }; TERMS];
    let (mut re, mut im) = (1.0, 0.0);
    for m in 0..=GLOSS_ORDER {
        for l in m..=GLOSS_ORDER {
            let value = legendre[l][m];
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
    use crate::model::frame::TableFrame;
    use crate::model::shading::ShadingModel;
    use crate::tests::basis_at;
    use crate::{Elevation, MaterialKind};
    use relight_core::image::{Extent, Planes};
    use relight_core::light::{Direction, Normals, Order, Rotation};
    use relight_core::render::{DiffuseForm, DiffuseLayer};

    fn light() -> ShLight {
        let values = [9.0, 0.6, -0.5, 0.4, 0.3, -0.2, 0.5, 0.1, -0.4];
        ShLight::new(values.map(|v| [v, 0.5 * v + 0.2, v - 0.1]).to_vec()).unwrap()
    }

    #[test]
    fn the_curve_of_a_normal_is_its_shading_under_the_turning_light() {
        let frame = TableFrame::new(Elevation::measured(23.0).unwrap());
        let table = TableLight::from_light(&light().rotated(&frame.rotation())).irradiance();
        let (sin, cos) = 23.0_f64.to_radians().sin_cos();
        let axis = Direction::new(0.0, cos, sin).unwrap();
        let normal = Direction::new(0.3, -0.2, 0.7).unwrap().components();
        let harmonics = table.harmonics(&terms_along(frame.to_table(normal)));
        for angle in [0.0_f64, 0.4, 1.9, 4.4] {
            let turned = light().rotated(&Rotation::about(axis, -angle));
            let map = Normals::new(Planes::filled(Extent::new(1, 1), normal.map(|v| v as f32)));
            let layer = DiffuseLayer::new(&turned, DiffuseForm::Irradiance);
            let shading = layer.shading(&map).planes().pixel(0, 0);
            let basis = basis_at(angle);
            for (shading, harmonics) in shading.into_iter().zip(harmonics) {
                let value: f64 = basis.iter().zip(harmonics).map(|(a, b)| a * b).sum();
                assert!(
                    (value - f64::from(shading)).abs() < 1e-4,
                    "{value} {shading}"
                );
            }
        }
    }

    #[test]
    fn light_comes_back_from_what_is_seen_of_it() {
        let frame = TableFrame::new(Elevation::measured(40.0).unwrap());
        for material in [MaterialKind::Diffuse, MaterialKind::Metal] {
            let back = ShadingModel::in_light(&light(), frame, material)
                .light()
                .unwrap();
            for (a, b) in back.coefficients().iter().zip(light().coefficients()) {
                assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9));
            }
        }
    }

    #[test]
    fn white_metal_is_as_bright_as_a_lambertian_white_surface_in_even_light() {
        let frame = TableFrame::new(Elevation::assumed());
        let even = ShLight::even(Order::TWO, [1.0; 3]);
        for material in [MaterialKind::Diffuse, MaterialKind::Metal] {
            let model = ShadingModel::in_light(&even, frame, material);
            let shown = model.harmonics([0.48, 0.36, 0.8])[1];
            assert!((shown[0] - PI).abs() < 1e-6, "{material:?} {shown:?}");
        }
    }

    #[test]
    fn terms_of_one_band_have_the_same_sum_of_squares_everywhere() {
        // The addition theorem: that sum is 2 l + 1 on the whole sphere, at every angle of the table.
        for direction in [[0.6, 0.48, 0.64], [0.0, -0.8, -0.6], [0.28, 0.96, 0.0]] {
            let terms = terms_along(direction);
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
                    let expected = (2 * l + 1) as f64;
                    assert!((sum / expected - 1.0).abs() < 1e-9, "{l}: {sum}");
                }
            }
        }
    }
}
