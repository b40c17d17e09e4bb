//! Light of order 2 in the table's frame, as it acts on the curve of a pixel.

use std::f64::consts::PI;

use relight_core::light::{LightError, Order, ShLight};
use relight_core::render::cosine_lobe;

use crate::model::frame::TableFrame;
use crate::model::harmonics::{COEFFICIENTS, HarmonicTerm, LAMBERTIAN_COEFFICIENTS};

/// Terms of a channel's light.
pub(crate) const TERMS: usize = 9;

/// Bands of the light that a Lambertian surface shows.
pub(crate) const LAMBERTIAN_BANDS: usize = 3;

/// What each term of [`TableLight`] is of a coefficient of the spherical harmonics: its index and factor.
/// The factors are those of the cosine lobe, pi, 2 pi / 3 and pi / 4, times those of the polynomials.
pub(crate) const OF_COEFFICIENTS: [(usize, f64); TERMS] = {
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

/// Which term of the gloss shows the same part of the environment light as each term of [`TableLight`], and how many
/// times as large the latter is: the factor of its cosine lobe and polynomial.
pub(crate) const LAMBERTIAN_IN_GLOSS: [(usize, f64); TERMS] = {
    const AT: [usize; TERMS] = [0, 1, 4, 2, 3, 5, 6, 7, 8];
    let mut all = [(0, 0.0); TERMS];
    let mut term = 0;
    while term < TERMS {
        all[term] = (AT[term], OF_COEFFICIENTS[term].1.abs());
        term += 1;
    }
    all
};

/// How much of all its light a light that was found may lack from some side. Measured on the 16 synthetic turns of seed
/// 3001: lights that lack up to 0.4 of it go with normals no worse than others do, for their terms also stand for shade and
/// gloss that the model does not have.
const MOST_NEGATIVE: f64 = 0.5;

/// How far its light may come from one side: the length of its first moment over all of it. That of a single lamp has 1, and a
/// tenth is left to noise.
const MOST_ONE_SIDED: f64 = 1.1;

/// The irradiance of the environment light on a normal, while the table turns: with the normal (x, y, z) in the
/// table's frame and q = x + i y,
///
/// `E(t) = e + f z + g (3 z² - 1) + Re((a + b z) q e^(i t)) + Re(d q² e^(2 i t))`.
///
/// The terms of each channel are e, f, g, Re a, Im a, Re b, Im b, Re d, Im d.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableLight {
    terms: [[f64; TERMS]; 3],
}

impl TableLight {
    /// The light of these terms, one list a channel.
    #[must_use]
    pub const fn new(terms: [[f64; TERMS]; 3]) -> Self {
        Self { terms }
    }

    /// The first nine coefficients of a light in the viewer's frame at the table's angle 0.
    #[must_use]
    pub fn from_viewer(light: &ShLight, frame: &TableFrame) -> Self {
        let light = light.with_order(Order::TWO).rotated(&frame.rotation());
        let coefficients = light.coefficients();
        let terms = [0, 1, 2]
            .map(|channel| OF_COEFFICIENTS.map(|(at, factor)| factor * coefficients[at][channel]));
        Self { terms }
    }

    /// The same as coefficients in the table's frame.
    ///
    /// # Errors
    /// Where a term is not finite.
    pub fn coefficients(&self) -> Result<ShLight, LightError> {
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
    pub fn to_viewer(&self, frame: &TableFrame) -> Result<ShLight, LightError> {
        Ok(self.coefficients()?.rotated(&frame.rotation().inverse()))
    }

    /// From where more light comes, by the first harmonic of a level normal's curve: the azimuth in the table's frame
    /// at angle 0, from x towards y, degrees.
    #[must_use]
    pub fn bright_azimuth_deg(&self) -> f64 {
        let sum = |at: usize| self.terms.iter().map(|terms| terms[at]).sum::<f64>();
        (-sum(4)).atan2(sum(3)).to_degrees()
    }

    /// How much the first harmonic of a level normal's curve is of the mean over all normals: 0 where no side is brighter.
    #[must_use]
    pub fn bright_part(&self) -> f64 {
        let sum = |at: usize| self.terms.iter().map(|terms| terms[at]).sum::<f64>();
        sum(3).hypot(sum(4)) / sum(0).max(f64::MIN_POSITIVE)
    }

    /// Whether light that is nowhere negative could have these terms, but for a part that stands for what the model does
    /// not have: of such light L the moments `[∫L, ∫Lωᵀ; ∫Lω, ∫Lωωᵀ]` are positive semidefinite, and no more is asked
    /// of them, for a polynomial of order 2 that is nowhere negative on the sphere is a sum of squares there (the S-lemma).
    #[must_use]
    pub fn is_possible(&self) -> bool {
        self.coefficients().is_ok_and(|light| {
            (0..3).all(|channel| {
                let mut moments = moments(&light, channel);
                let [all, x, y, z] = moments[0];
                if x.hypot(y).hypot(z) > MOST_ONE_SIDED * all {
                    return false;
                }
                let slack = MOST_NEGATIVE * moments[0][0];
                (0..4).for_each(|k| moments[k][k] += slack);
                is_positive_semidefinite(moments)
            })
        })
    }

    /// The terms of each channel.
    #[must_use]
    pub const fn terms(&self) -> &[[f64; TERMS]; 3] {
        &self.terms
    }

    /// The same light with each channel times a factor.
    #[must_use]
    pub fn times(mut self, factors: [f64; 3]) -> Self {
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

/// The moments of a channel's light over all directions up to order 2, in the order 1, x, y, z.
fn moments(light: &ShLight, channel: usize) -> [[f64; 4]; 4] {
    // A coefficient is the light's moment with its polynomial, which is such a factor, without the lobe's, times 1, y, z, x,
    // 2xy, yz, 3z² - 1, xz and x² - y².
    let mut of = [0.0; TERMS];
    for (at, factor) in OF_COEFFICIENTS {
        of[at] = light.coefficients()[at][channel] * cosine_lobe(at.isqrt()) / factor.abs();
    }
    let [all, y, z, x, across, yz, above, xz, apart] = of;
    let xy = across / 2.0;
    let zz = (all + above) / 3.0;
    let (xx, yy) = ((all - zz + apart) / 2.0, (all - zz - apart) / 2.0);
    [
        [all, x, y, z],
        [x, xx, xy, xz],
        [y, xy, yy, yz],
        [z, xz, yz, zz],
    ]
}

/// Whether a symmetric matrix is positive semidefinite, by its Cholesky decomposition.
fn is_positive_semidefinite(mut matrix: [[f64; 4]; 4]) -> bool {
    for k in 0..4 {
        let row = matrix[k];
        let pivot = row[k];
        if pivot < 0.0 {
            return false;
        }
        for below in &mut matrix[k + 1..] {
            if pivot > f64::MIN_POSITIVE {
                let factor = below[k] / pivot;
                let pairs = below.iter_mut().zip(row).skip(k + 1);
                pairs.for_each(|(value, above)| *value -= factor * above);
            } else if below[k] != 0.0 {
                // A column of a semidefinite matrix is 0 where its diagonal is.
                return false;
            }
        }
    }
    true
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
    fn light_from_one_side_is_possible_and_what_is_brighter_there_than_all_light_is_not() {
        let frame = TableFrame::new(Elevation::given(23.0).unwrap());
        let towards = Direction::new(0.3, 0.5, 0.4).unwrap();
        let point = relight_core::light::basis(Order::TWO, towards);
        let stretched = |factor: f64| {
            let values = point.iter().enumerate();
            let values = values.map(|(at, value)| [value * if at == 0 { 1.0 } else { factor }; 3]);
            TableLight::from_viewer(&ShLight::new(values.collect()).unwrap(), &frame)
        };
        assert!(stretched(1.0).is_possible());
        assert!(!stretched(1.3).is_possible());
        assert!(!stretched(30.0).is_possible());
        assert!(TableLight::from_viewer(&light(), &frame).is_possible());
    }

    #[test]
    fn light_that_would_be_negative_on_two_sides_is_not_possible_though_none_is_brighter() {
        let towards = Direction::new(0.3, 0.5, 0.4).unwrap();
        let point = relight_core::light::basis(Order::TWO, towards);
        let of_second_band = |factor: f64| {
            let values = point.iter().enumerate();
            let values = values.map(|(at, value)| match at {
                0 => [*value; 3],
                1..4 => [0.0; 3],
                _ => [factor * value; 3],
            });
            let light = ShLight::new(values.collect()).unwrap();
            TableLight::from_viewer(&light, &TableFrame::new(Elevation::assumed()))
        };
        // All light from a ring lacks nothing; -0.5 is its second band.
        assert!(of_second_band(-0.5).is_possible());
        assert!(!of_second_band(-2.0).is_possible());
    }

    #[test]
    fn moments_are_those_of_the_light() {
        let towards = Direction::new(0.3, 0.5, 0.4).unwrap();
        let [x, y, z] = towards.components();
        let point = relight_core::light::basis(Order::TWO, towards);
        let light = ShLight::new(point.iter().map(|&value| [value; 3]).collect()).unwrap();
        let expected = [1.0, x, y, z];
        for (row, a) in moments(&light, 1).iter().zip(expected) {
            for (found, b) in row.iter().zip(expected) {
                assert!((found - a * b).abs() < 1e-9, "{found} {}", a * b);
            }
        }
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
    fn the_bright_side_is_where_the_light_comes_from() {
        let mut light = ShLight::even(Order::TWO, [1.0; 3]);
        // Y_1,1 is x, Y_1,-1 is y.
        light.coefficients_mut()[3] = [0.3; 3];
        light.coefficients_mut()[1] = [0.3; 3];
        let frame = TableFrame::new(Elevation::given(0.0).unwrap());
        let viewer = light.rotated(&frame.rotation().inverse());
        let table = TableLight::from_viewer(&viewer, &frame);
        assert!((table.bright_azimuth_deg() - 45.0).abs() < 1e-6);
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
