//! Light of order 2 in the table's frame, as it acts on the curve of a pixel.

use std::f64::consts::PI;

use relight_core::light::{LightError, Order, ShLight};

use crate::model::frame::TableFrame;
use crate::model::gloss::{GlossLight, MIRROR};
use crate::model::harmonics::{COEFFICIENTS, HarmonicTerm, LAMBERTIAN_COEFFICIENTS};

/// Terms of a channel's light.
pub(crate) const TERMS: usize = 9;

/// Bands of the light that a Lambertian surface shows.
pub(crate) const LAMBERTIAN_BANDS: usize = 3;

/// What each term of [`TableLight`] is of a coefficient of the spherical harmonics: its index and factor.
/// The factors are those of the cosine lobe, pi, 2 pi / 3 and pi / 4, times those of the polynomials.
const OF_COEFFICIENTS: [(usize, f64); TERMS] = {
    const Y0: f64 = 0.282_094_791_773_878_14;
    const Y1: f64 = 0.488_602_511_902_919_9;
    const Y20: f64 = 0.315_391_565_252_520_05;
    const Y21: f64 = 1.092_548_430_592_079_2;
    const Y22: f64 = 0.546_274_215_296_039_6;
    const A1: f64 = 2.0 * PI / 3.0;
    const A2: f64 = PI / 4.0;
    [
        (0, PI * Y0),
        (2, A1 * Y1),
        (6, A2 * Y20),
        (3, A1 * Y1),
        (1, -A1 * Y1),
        (7, A2 * Y21),
        (5, -A2 * Y21),
        (8, A2 * Y22),
        (4, -A2 * Y22),
    ]
};

/// The irradiance of the environment light on a normal, while the table turns: with the normal (x, y, z) in the
/// table's frame and q = x + i y,
///
/// `E(t) = e + f z + g (3 z² - 1) + Re((a + b z) q e^(i t)) + Re(d q² e^(2 i t))`.
///
/// The terms of each channel are e, f, g, Re a, Im a, Re b, Im b, Re d, Im d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TableLight {
    terms: [[f64; TERMS]; 3],
}

impl TableLight {
    /// The light of these terms, one list a channel.
    pub(crate) const fn new(terms: [[f64; TERMS]; 3]) -> Self {
        Self { terms }
    }

    /// The first nine coefficients of a light in the viewer's frame at the table's angle 0.
    pub(crate) fn from_viewer(light: &ShLight, frame: &TableFrame) -> Self {
        let light = light.with_order(Order::TWO).rotated(&frame.rotation());
        let coefficients = light.coefficients();
        let terms = [0, 1, 2]
            .map(|channel| OF_COEFFICIENTS.map(|(at, factor)| factor * coefficients[at][channel]));
        Self { terms }
    }

    /// The light of which a mirror shows this.
    ///
    /// # Errors
    /// Where a term is not finite.
    pub(crate) fn of_mirror(shown: &GlossLight) -> Result<Self, LightError> {
        let light = shown.light()?;
        let coefficients = light.coefficients();
        let factor = |channel: usize| {
            OF_COEFFICIENTS.map(|(at, factor)| factor * coefficients[at][channel] / MIRROR)
        };
        Ok(Self::new([0, 1, 2].map(factor)))
    }

    /// The same as coefficients in the table's frame.
    ///
    /// # Errors
    /// Where a term is not finite.
    pub(crate) fn coefficients(&self) -> Result<ShLight, LightError> {
        let mut coefficients = vec![[0.0; 3]; TERMS];
        for (term, (at, factor)) in OF_COEFFICIENTS.into_iter().enumerate() {
            coefficients[at] = [0, 1, 2].map(|channel| self.terms[channel][term] / factor);
        }
        ShLight::new(coefficients)
    }

    /// The same as coefficients in the viewer's frame, at the table's angle 0.
    ///
    /// # Errors
    /// Where a term is not finite.
    pub(crate) fn to_viewer(self, frame: &TableFrame) -> Result<ShLight, LightError> {
        Ok(self.coefficients()?.rotated(&frame.rotation().inverse()))
    }

    /// The terms of each channel.
    pub(crate) const fn terms(&self) -> &[[f64; TERMS]; 3] {
        &self.terms
    }

    /// The same light with each channel times a factor.
    pub(crate) fn times(mut self, factors: [f64; 3]) -> Self {
        for (terms, factor) in self.terms.iter_mut().zip(factors) {
            terms.iter_mut().for_each(|term| *term *= factor);
        }
        self
    }

    /// The irradiance on a normal in the table's frame, as factors of 1, cos t, -sin t, cos 2t, -sin 2t, and
    /// 0 for the other harmonics.
    pub(crate) fn harmonics(&self, normal: [f64; 3]) -> [[f64; COEFFICIENTS]; 3] {
        let [x, y, z] = normal;
        let (x2, y2) = (x * x - y * y, 2.0 * x * y);
        let square = 3.0 * z * z - 1.0;
        self.terms
            .each_ref()
            .map(|[e, f, g, ar, ai, br, bi, dr, di]| {
                let (re, im) = (ar + br * z, ai + bi * z);
                let mut harmonics = [0.0; COEFFICIENTS];
                harmonics[..LAMBERTIAN_COEFFICIENTS].copy_from_slice(&[
                    e + f * z + g * square,
                    re * x - im * y,
                    re * y + im * x,
                    dr * x2 - di * y2,
                    dr * y2 + di * x2,
                ]);
                harmonics
            })
    }
}

/// What each term of the light contributes to the harmonics of a normal in the table's frame.
pub(crate) fn lambertian_terms([x, y, z]: [f64; 3]) -> [HarmonicTerm; TERMS] {
    let (x2, y2) = (x * x - y * y, 2.0 * x * y);
    let term = |coefficient, a, b| HarmonicTerm {
        coefficient,
        parts: [a, b],
    };
    [
        term(0, 1.0, 0.0),
        term(0, z, 0.0),
        term(0, 3.0 * z * z - 1.0, 0.0),
        term(1, x, y),
        term(1, -y, x),
        term(1, x * z, y * z),
        term(1, -y * z, x * z),
        term(3, x2, y2),
        term(3, -y2, x2),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Elevation;
    use relight_core::image::{Extent, Planes};
    use relight_core::light::{Direction, Normals, Rotation};
    use relight_core::render::{DiffuseForm, DiffuseLayer};

    fn light() -> ShLight {
        let values = [9.0, 0.6, -0.5, 0.4, 0.3, -0.2, 0.5, 0.1, -0.4];
        ShLight::new(values.map(|v| [v, 0.5 * v + 0.2, v - 0.1]).to_vec()).unwrap()
    }

    #[test]
    fn the_curve_of_a_normal_is_its_shading_under_the_turning_light() {
        let frame = TableFrame::new(Elevation::given(23.0).unwrap());
        let table = TableLight::from_viewer(&light(), &frame);
        let (sin, cos) = 23.0_f64.to_radians().sin_cos();
        let axis = Direction::new(0.0, cos, sin).unwrap();
        let normal = Direction::new(0.3, -0.2, 0.7).unwrap().components();
        let harmonics = table.harmonics(frame.to_table(normal));
        for angle in [0.0_f64, 0.4, 1.9, 4.4] {
            let turned = light().rotated(&Rotation::about(axis, -angle));
            let map = Normals::new(Planes::filled(Extent::new(1, 1), normal.map(|v| v as f32)));
            let layer = DiffuseLayer::new(&turned, DiffuseForm::Irradiance);
            let shading = layer.shading(&map).planes().pixel(0, 0);
            let basis = [
                1.0,
                angle.cos(),
                -angle.sin(),
                (2.0 * angle).cos(),
                -(2.0 * angle).sin(),
            ];
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
    fn light_comes_back_from_the_table_s_frame() {
        let frame = TableFrame::new(Elevation::given(40.0).unwrap());
        let table = TableLight::from_viewer(&light(), &frame);
        let back = table.to_viewer(&frame).unwrap();
        for (a, b) in back.coefficients().iter().zip(light().coefficients()) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9));
        }
    }

    fn part(term: HarmonicTerm, coefficient: usize) -> f64 {
        let at = coefficient.checked_sub(term.coefficient);
        at.and_then(|at| term.parts.get(at).copied()).unwrap_or(0.0)
    }

    #[test]
    fn harmonics_are_the_sum_of_their_terms() {
        let table = TableLight::from_viewer(&light(), &TableFrame::new(Elevation::assumed()));
        let normal = [0.48, -0.6, 0.64];
        let terms = lambertian_terms(normal);
        for (channel, harmonics) in table.harmonics(normal).iter().enumerate() {
            for (coefficient, value) in harmonics.iter().enumerate() {
                let parts = table.terms()[channel].iter().zip(terms);
                let sum: f64 = parts
                    .map(|(light, term)| light * part(term, coefficient))
                    .sum();
                assert!((sum - value).abs() < 1e-12);
            }
        }
    }
}
