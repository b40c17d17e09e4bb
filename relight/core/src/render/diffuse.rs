//! Diffuse light on normals: the quadratic form of Ramamoorthi and Hanrahan.

use std::f64::consts::PI;

use super::lanes::{self, Kernel, Lanes, Number};
use crate::image::{Linear, Planes, Rgb};
use crate::light::{Normals, Order, ShLight, YUp};

/// How the shading of a diffuse surface follows from the nine coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DiffuseForm {
    /// S = max(E, 0), where E is the irradiance.
    #[default]
    Irradiance,
    /// S = max(E', 0) + 0.1, where E' has |L00| in place of L00: as the paper's released code has
    /// it, whose networks were trained with it.
    Released,
}

/// What the released form adds to every shading.
pub const RELEASED_AMBIENT: f64 = 0.1;

/// The constants c1 to c5 of the quadratic form: products of the cosine lobe's coefficients π, 2π/3
/// and π/4 with those of the polynomials of [`basis`](crate::light::basis).
const C: [f64; 5] = [
    0.429_042_765_404_891_7,
    0.511_663_353_973_244_1,
    0.743_123_868_301_127_1,
    0.886_226_925_452_757_9,
    0.247_707_956_100_375_71,
];

/// c1 to c5 of the quadratic form.
pub fn diffuse_constants() -> [f64; 5] {
    C
}

/// The diffuse layer for one light: irradiance on any normal.
///
/// E(n) = Σ Â_l C_lm Y_lm(n) over l ≤ 2 (paper, section 4.2.1), written as the polynomial n^T M n of
/// Ramamoorthi and Hanrahan, *An Efficient Representation for Irradiance Environment Maps*, 2001. It
/// is the integral of radiance times max(0, n·ω) over the sphere; even light of radiance 1 gives π.
/// Higher bands of the light hardly matter, and are left out.
///
/// ```
/// use relight_core::light::{Normals, Order, ShLight};
/// use relight_core::render::{DiffuseForm, DiffuseLayer};
///
/// let layer = DiffuseLayer::new(&ShLight::even(Order::TWO, [1.0; 3]), DiffuseForm::Irradiance);
/// let shading = layer.shading(&Normals::sphere(9));
/// assert!((shading.planes().pixel(4, 4)[0] - std::f32::consts::PI).abs() < 1e-5);
/// assert_eq!(shading.planes().pixel(0, 0), [0.0; 3]); // beside the sphere
/// ```
#[derive(Debug, Clone)]
pub struct DiffuseLayer {
    form: DiffuseForm,
    /// As given, but with |L00| in the released form.
    coefficients: [[f64; 3]; 9],
    /// What becomes of an increase of L00, -1 or 1.
    sign: [f64; 3],
}

impl DiffuseLayer {
    /// The layer for a light, of which the first nine coefficients count.
    #[must_use]
    pub fn new(light: &ShLight, form: DiffuseForm) -> Self {
        let mut coefficients = [[0.0; 3]; 9];
        for (to, from) in coefficients.iter_mut().zip(light.coefficients()) {
            *to = *from;
        }
        let mut sign = [1.0; 3];
        if form == DiffuseForm::Released {
            sign = coefficients[0].map(f64::signum);
            coefficients[0] = coefficients[0].map(f64::abs);
        }
        Self {
            form,
            coefficients,
            sign,
        }
    }

    /// The shading S, 0 where there is no surface.
    #[must_use]
    pub fn shading(&self, normals: &Normals<YUp>) -> Rgb<Linear> {
        let mut shading = Planes::zeros(normals.extent());
        lanes::run(self, normals.planes().planes(), shading.planes_mut());
        Rgb::new(shading)
    }

    /// The shading of one unit normal.
    pub(super) fn at(&self, normal: [f64; 3]) -> [f64; 3] {
        let terms = terms(normal);
        let sums: [f64; 3] = [0, 1, 2].map(|channel| {
            let products = terms.iter().zip(&self.coefficients);
            products.map(|(term, c)| term * c[channel]).sum()
        });
        sums.map(|sum| sum.max(0.0) + self.ambient())
    }

    /// What the shading of one normal passes back of `upstream`, the derivative by that shading: the
    /// derivative by the normal's components, as the polynomial has it, returned; that by the light's
    /// first nine coefficients, added to those of `light`.
    pub(super) fn backward(
        &self,
        normal: [f64; 3],
        upstream: [f64; 3],
        light: &mut [[f64; 3]],
    ) -> [f64; 3] {
        let terms = terms(normal);
        let gradients = gradients(normal);
        let mut by_normal = [0.0; 3];
        for channel in 0..3 {
            let products = terms.iter().zip(&self.coefficients);
            let sum: f64 = products.map(|(term, c)| term * c[channel]).sum();
            if sum <= 0.0 {
                continue;
            }
            for (at, (term, gradient)) in terms.iter().zip(gradients).enumerate() {
                let sign = if at == 0 { self.sign[channel] } else { 1.0 };
                light[at][channel] += upstream[channel] * term * sign;
                for (sum, gradient) in by_normal.iter_mut().zip(gradient) {
                    *sum += upstream[channel] * self.coefficients[at][channel] * gradient;
                }
            }
        }
        by_normal
    }

    /// The order of the light that counts.
    pub(super) const ORDER: Order = Order::TWO;

    fn ambient(&self) -> f64 {
        match self.form {
            DiffuseForm::Irradiance => 0.0,
            DiffuseForm::Released => RELEASED_AMBIENT,
        }
    }
}

/// What each of the nine coefficients is multiplied with: Â_l Y_lm(n).
#[inline(always)]
pub(super) fn terms<T: Number>([x, y, z]: [T; 3]) -> [T; 9] {
    let [c1, c2, c3, c4, c5] = C.map(T::of);
    let two = T::of(2.0);
    [
        c4,
        two * c2 * y,
        two * c2 * z,
        two * c2 * x,
        two * c1 * x * y,
        two * c1 * y * z,
        c3 * z * z - c5,
        two * c1 * x * z,
        c1 * (x * x - y * y),
    ]
}

/// The derivatives of [`terms`] by x, y and z.
fn gradients([x, y, z]: [f64; 3]) -> [[f64; 3]; 9] {
    let [c1, c2, c3, ..] = C.map(|c| 2.0 * c);
    [
        [0.0, 0.0, 0.0],
        [0.0, c2, 0.0],
        [0.0, 0.0, c2],
        [c2, 0.0, 0.0],
        [c1 * y, c1 * x, 0.0],
        [0.0, c1 * z, c1 * y],
        [0.0, 0.0, c3 * z],
        [c1 * z, 0.0, c1 * x],
        [c1 * x, -c1 * y, 0.0],
    ]
}

impl Kernel<3, 3> for DiffuseLayer {
    type Scratch = ();

    fn scratch(&self) {}

    #[inline(always)]
    fn run(&self, (): &mut (), normal: [Lanes; 3]) -> [Lanes; 3] {
        let terms = terms(normal);
        let surface = Lanes::surface(normal);
        let ambient = Lanes::of(self.ambient());
        let mut shading = [Lanes::all(0.0); 3];
        for (channel, shading) in shading.iter_mut().enumerate() {
            let mut sum = Lanes::all(0.0);
            for (term, c) in terms.iter().zip(&self.coefficients) {
                sum = sum + *term * Lanes::of(c[channel]);
            }
            *shading = (sum.at_least_zero() + ambient) * surface;
        }
        shading
    }
}

/// The coefficients Â_l of the cosine lobe for l = 0, 1, 2.
pub(super) const COSINE_LOBE: [f64; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Direction, basis};

    fn some_light() -> ShLight {
        let value = |i: usize| ((i * i + 1) as f64).sin();
        ShLight::new(
            (0..9)
                .map(|i| [value(i), value(i + 9) - 0.3, 2.0])
                .collect(),
        )
        .unwrap()
    }

    #[test]
    fn the_constants_are_those_of_the_article() {
        let printed = [0.429_043, 0.511_664, 0.743_125, 0.886_227, 0.247_708];
        for (ours, printed) in C.iter().zip(printed) {
            assert!((ours - printed).abs() < 2e-6);
        }
    }

    #[test]
    fn the_terms_are_the_harmonics_times_the_cosine_lobe() {
        let direction = Direction::new(0.3, -0.5, 0.7).unwrap();
        let values = basis(Order::TWO, direction);
        for (at, term) in terms(direction.components()).into_iter().enumerate() {
            let lobe = COSINE_LOBE[at.isqrt()];
            assert!((term - lobe * values[at]).abs() < 1e-12, "{at}");
        }
    }

    /// Irradiance by quadrature over the sphere.
    fn hemisphere_integral(light: &ShLight, normal: Direction) -> [f64; 3] {
        let (rows, columns) = (200, 400);
        let mut sum = [0.0; 3];
        for i in 0..rows {
            let polar = PI * (f64::from(i) + 0.5) / f64::from(rows);
            let area = polar.sin() * PI / f64::from(rows) * 2.0 * PI / f64::from(columns);
            for j in 0..columns {
                let azimuth = 2.0 * PI * f64::from(j) / f64::from(columns);
                let from = Direction::from_angles(polar, azimuth);
                let weight = area * normal.dot(from).max(0.0);
                for (sum, r) in sum.iter_mut().zip(light.radiance(from)) {
                    *sum += weight * r;
                }
            }
        }
        sum
    }

    #[test]
    fn the_shading_is_the_integral_over_the_hemisphere() {
        let light = some_light();
        let layer = DiffuseLayer::new(&light, DiffuseForm::Irradiance);
        for (x, y, z) in [(0.0, 0.0, 1.0), (0.6, -0.2, 0.4), (-0.9, 0.3, 0.1)] {
            let normal = Direction::new(x, y, z).unwrap();
            let integral = hemisphere_integral(&light, normal);
            let shading = layer.at(normal.components());
            for (a, b) in shading.iter().zip(integral) {
                assert!((a - b.max(0.0)).abs() < 1e-3, "{shading:?} {integral:?}");
            }
        }
    }

    #[test]
    fn the_released_form_has_its_own_first_coefficient_and_ambient_light() {
        let mut light = ShLight::dark(Order::TWO);
        light.coefficients_mut()[0] = [-2.0, 0.0, 2.0];
        let at = |form| DiffuseLayer::new(&light, form).at([0.0, 0.0, 1.0]);
        let [red, green, blue] = at(DiffuseForm::Released);
        assert!((red - blue).abs() < 1e-12 && (red - (2.0 * C[3] + 0.1)).abs() < 1e-12);
        assert!((green - 0.1).abs() < 1e-12);
        assert!(at(DiffuseForm::Irradiance)[0].abs() < 1e-12);
    }

    #[test]
    fn an_image_has_the_shading_of_each_of_its_normals() {
        let normals = Normals::sphere(33);
        for form in [DiffuseForm::Irradiance, DiffuseForm::Released] {
            let layer = DiffuseLayer::new(&some_light(), form);
            let image = layer.shading(&normals);
            for (x, y) in [(16, 16), (5, 9), (30, 20)] {
                let normal = normals.planes().pixel(x, y).map(f64::from);
                let pairs = image.planes().pixel(x, y).into_iter().zip(layer.at(normal));
                for (fast, exact) in pairs {
                    assert!((f64::from(fast) - exact).abs() < 1e-5);
                }
            }
            assert_eq!(image.planes().pixel(0, 0), [0.0; 3]);
        }
    }
}
