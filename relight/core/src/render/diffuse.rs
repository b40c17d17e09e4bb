//! Diffuse light on normals: the quadratic form of Ramamoorthi and Hanrahan, and the bands beyond it.

use std::f64::consts::PI;

use super::series::HarmonicSeries;
use super::simd;
use super::simd::{Kernel, Lanes, Number};
use crate::image::{Linear, Planes, Rgb};
use crate::light::{Normals, Order, ShLight};

/// How the shading of a Lambertian surface follows from the light's coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum DiffuseForm {
    /// S = max(E, 0), where E is the irradiance of all bands that the light has.
    #[default]
    Irradiance,
    /// S = max(E', 0) + 0.1, where E' has |L00| in place of L00: as the paper's released code has
    /// it, whose networks were trained with it. Nine coefficients count.
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
/// E(n) = Σ Â_l C_lm Y_lm(n) is the integral of radiance times max(0, n·ω) over the sphere; even light of radiance 1
/// gives π. Up to band 2 (paper, section 4.2.1) it is written as the polynomial n^T M n of Ramamoorthi and Hanrahan,
/// *An Efficient Representation for Irradiance Environment Maps*, 2001. Of the bands beyond, the odd ones have no
/// irradiance, and the even ones are added: Â_l = 2π (-1)^(l/2 - 1) / ((l + 2) (l - 1)) l! / (2^l (l/2)!²). They are 6 %
/// of the irradiance of panoramas of rooms and skies in the mean, and 25 % under a sun.
///
/// Images leave out the last bands as long as the root mean square of their irradiance over the sphere is below 0.002 of
/// the mean irradiance, half a step of 8 bits: rooms and skies need 8 to 16 bands, however many they are given by.
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
    /// The order of the light that counts.
    order: Order,
    /// The contribution of the bands beyond 2, if there are any.
    higher: Option<HigherBands>,
}

/// Irradiance of the bands beyond 2: Â_l C_lm.
#[derive(Debug, Clone)]
struct HigherBands {
    exact: HarmonicSeries,
    /// Without the last bands, as far as they do not show.
    visible: HarmonicSeries,
}

/// What the bands that an image leaves out have at most: the root mean square of their irradiance over that of the mean.
const INVISIBLE: f64 = 2e-3;

impl DiffuseLayer {
    /// The layer for a light: all of its bands count, or the first three in the released form.
    pub fn new(light: &ShLight, form: DiffuseForm) -> Self {
        let mut coefficients = [[0.0; 3]; 9];
        for (to, from) in coefficients.iter_mut().zip(light.coefficients()) {
            *to = *from;
        }
        if form == DiffuseForm::Released {
            coefficients[0] = coefficients[0].map(f64::abs);
        }
        let (order, higher) = match form {
            DiffuseForm::Irradiance => (
                light.order().max(Order::TWO),
                HigherBands::from_light(light),
            ),
            DiffuseForm::Released => (Order::TWO, None),
        };
        Self {
            form,
            coefficients,
            order,
            higher,
        }
    }

    /// The shading S, 0 outside the object.
    pub fn shading(&self, normals: &Normals) -> Rgb<Linear> {
        let mut shading = Planes::zeros(normals.extent());
        simd::run(self, normals.planes().planes(), shading.planes_mut());
        Rgb::new(shading)
    }

    /// The shading of one unit normal.
    pub(super) fn at(&self, normal: [f64; 3]) -> [f64; 3] {
        self.irradiance(&terms(normal), normal)
            .map(|sum| sum.max(0.0) + self.ambient())
    }

    /// E of one unit normal.
    fn irradiance(&self, terms: &[f64; 9], normal: [f64; 3]) -> [f64; 3] {
        let higher = match &self.higher {
            Some(bands) => bands.exact.at(&vec![1.0; self.order.get() + 1], normal),
            None => [0.0; 3],
        };
        [0, 1, 2].map(|channel| {
            let products = terms.iter().zip(&self.coefficients);
            products.map(|(term, c)| term * c[channel]).sum::<f64>() + higher[channel]
        })
    }

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
    let [c1, c2, c3, c4, c5] = C.map(T::splat);
    let two = T::splat(2.0);
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

impl HigherBands {
    /// Those of a light; `None` if it has no even band beyond 2.
    fn from_light(light: &ShLight) -> Option<Self> {
        if light.order().get() < 4 {
            return None;
        }
        let mut irradiance = vec![[0.0; 3]; light.order().coefficients()];
        for l in (4..=light.order().get()).step_by(2) {
            let band = l * l..(l + 1) * (l + 1);
            for (to, from) in irradiance[band.clone()]
                .iter_mut()
                .zip(&light.coefficients()[band])
            {
                *to = from.map(|c| c * cosine_lobe(l));
            }
        }
        let visible = visible_order(light, &irradiance);
        Some(Self {
            visible: HarmonicSeries::new(visible, &irradiance[..visible.coefficients()]),
            exact: HarmonicSeries::new(light.order(), &irradiance),
        })
    }
}

/// The order beyond which the bands together stay below [`INVISIBLE`], in each channel.
fn visible_order(light: &ShLight, irradiance: &[[f64; 3]]) -> Order {
    // The harmonics are orthonormal: the mean square over the sphere is the sum of squares over 4π, which both sides have.
    let most = light.coefficients()[0].map(|c| (INVISIBLE * PI * c).powi(2));
    let mut left_out = [0.0; 3];
    let mut order = light.order().get();
    while order > 4 {
        let band = &irradiance[order * order..(order + 1) * (order + 1)];
        for (channel, sum) in left_out.iter_mut().enumerate() {
            *sum += band.iter().map(|c| c[channel] * c[channel]).sum::<f64>();
        }
        if left_out.iter().zip(most).any(|(&sum, most)| sum > most) {
            break;
        }
        order -= 1;
    }
    Order::new(order).unwrap_or(Order::HIGHEST)
}

impl Kernel<3, 3> for DiffuseLayer {
    /// The weights of the bands, all 1.
    type Scratch = Vec<Lanes>;

    fn scratch(&self) -> Self::Scratch {
        let bands = self
            .higher
            .as_ref()
            .map_or(0, |bands| bands.visible.order().get() + 1);
        vec![Lanes::all(1.0); bands]
    }

    #[inline(always)]
    fn run(&self, weights: &mut Self::Scratch, normal: [Lanes; 3]) -> [Lanes; 3] {
        let terms = terms(normal);
        let surface = Lanes::surface(normal);
        let ambient = Lanes::splat(self.ambient());
        let mut shading = match &self.higher {
            Some(bands) => bands.visible.at_lanes(weights, normal),
            None => [Lanes::all(0.0); 3],
        };
        for (channel, shading) in shading.iter_mut().enumerate() {
            let mut sum = *shading;
            for (term, c) in terms.iter().zip(&self.coefficients) {
                sum = sum + *term * Lanes::splat(c[channel]);
            }
            *shading = (sum.at_least_zero() + ambient) * surface;
        }
        shading
    }
}

/// The coefficients Â_l of the cosine lobe for l = 0, 1, 2.
pub(super) const COSINE_LOBE: [f64; 3] = [PI, 2.0 * PI / 3.0, PI / 4.0];

/// The coefficients Â_l of the cosine lobe: π, 2π / 3, π / 4, and for even l beyond
/// 2π (-1)^(l/2 - 1) / ((l + 2) (l - 1)) l! / (2^l (l/2)!²) (Ramamoorthi and Hanrahan, *On the relationship between
/// radiance and irradiance*, 2001); 0 for other odd l. Irradiance is light whose band l is Â_l times as strong.
pub fn cosine_lobe(l: usize) -> f64 {
    match l {
        0..=2 => COSINE_LOBE[l],
        _ if !l.is_multiple_of(2) => 0.0,
        _ => {
            // l! / (2^l (l/2)!²) is the product of (2k - 1) / 2k over k up to l/2.
            let half = l / 2;
            let central: f64 = (1..=half)
                .map(|k| (2 * k - 1) as f64 / (2 * k) as f64)
                .product();
            let sign = if half.is_multiple_of(2) { -1.0 } else { 1.0 };
            2.0 * PI * sign * central / ((l + 2) * (l - 1)) as f64
        }
    }
}

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

    /// A lamp before even light, as far as an order shows it.
    fn lamp(order: usize) -> ShLight {
        let order = Order::new(order).unwrap();
        let towards = basis(order, Direction::new(0.5, 0.6, 0.4).unwrap());
        let mut light = ShLight::even(order, [0.3; 3]);
        for (sum, value) in light.coefficients_mut().iter_mut().zip(towards) {
            for (sum, strength) in sum.iter_mut().zip([1.0, 0.8, 0.5]) {
                *sum += strength * value;
            }
        }
        light
    }

    #[test]
    fn the_constants_are_those_of_the_article() {
        let printed = [0.429_043, 0.511_664, 0.743_125, 0.886_227, 0.247_708];
        for (ours, printed) in C.iter().zip(printed) {
            assert!((ours - printed).abs() < 2e-6);
        }
    }

    #[test]
    fn the_bands_of_the_cosine_lobe_are_those_of_the_published_table() {
        let expected = [
            PI,
            2.0 * PI / 3.0,
            PI / 4.0,
            0.0,
            -PI / 24.0,
            0.0,
            PI / 64.0,
        ];
        for (l, expected) in expected.into_iter().enumerate() {
            assert!((cosine_lobe(l) - expected).abs() < 1e-9, "{l}");
        }
    }

    #[test]
    fn the_terms_are_the_harmonics_times_the_cosine_lobe() {
        let direction = Direction::new(0.3, -0.5, 0.7).unwrap();
        let values = basis(Order::TWO, direction);
        for (at, term) in terms(direction.components()).into_iter().enumerate() {
            let lobe = cosine_lobe(at.isqrt());
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
    fn the_shading_of_light_with_more_bands_is_the_integral_too() {
        let light = lamp(8);
        let layer = DiffuseLayer::new(&light, DiffuseForm::Irradiance);
        let nine = DiffuseLayer::new(&light.with_order(Order::TWO), DiffuseForm::Irradiance);
        let mut gained = 0.0_f64;
        for (x, y, z) in [(0.5, 0.6, 0.4), (0.6, -0.2, 0.4), (-0.9, 0.3, 0.1)] {
            let normal = Direction::new(x, y, z).unwrap();
            let integral = hemisphere_integral(&light, normal);
            let shading = layer.at(normal.components());
            for (a, b) in shading.iter().zip(integral) {
                assert!((a - b.max(0.0)).abs() < 1e-3, "{shading:?} {integral:?}");
            }
            gained = gained.max((shading[0] - nine.at(normal.components())[0]).abs());
        }
        assert!(gained > 0.02, "{gained}");
    }

    #[test]
    fn under_a_lamp_the_shading_is_the_cosine_and_nothing_behind_it() {
        let order = Order::new(48).unwrap();
        let towards = Direction::new(0.2, 0.3, 0.9).unwrap();
        let mut light = ShLight::dark(order);
        for (sum, value) in light
            .coefficients_mut()
            .iter_mut()
            .zip(basis(order, towards))
        {
            *sum = [value; 3];
        }
        let layer = DiffuseLayer::new(&light, DiffuseForm::Irradiance);
        for (polar, azimuth) in [(0.0, 0.0), (0.7, 1.0), (1.4, -2.0), (2.2, 0.5), (3.0, 2.0)] {
            let normal = Direction::from_angles(polar, azimuth);
            let cosine = normal.dot(towards).max(0.0);
            let shading = layer.at(normal.components())[0];
            // What bands beyond 48 hold: most where the cosine has its edge.
            assert!((shading - cosine).abs() < 4e-3, "{shading} {cosine}");
        }
    }

    #[test]
    fn an_image_leaves_out_only_bands_that_do_not_show() {
        let normals = Normals::sphere(33);
        let light = lamp(40);
        let layer = DiffuseLayer::new(&light, DiffuseForm::Irradiance);
        let mean = PI * light.coefficients()[0][0] / (4.0 * PI).sqrt();
        let image = layer.shading(&normals);
        let (mut square, mut count) = (0.0, 0.0);
        for (x, y) in (0..33 * 33).map(|at| (at % 33, at / 33)) {
            let normal = normals.planes().pixel(x, y).map(f64::from);
            if normal != [0.0; 3] {
                let fast = f64::from(image.planes().pixel(x, y)[0]);
                square += (fast - layer.at(normal)[0]).powi(2);
                count += 1.0;
            }
        }
        let error = (square / count).sqrt();
        assert!(error < 2.0 * INVISIBLE * mean, "{error} of {mean}");
        assert!(layer.higher.unwrap().visible.order().get() < 40);
        // A light that is smooth all the same costs no more than what it shows.
        let smooth = light.with_order(Order::TWO).with_order(Order::HIGHEST);
        let layer = DiffuseLayer::new(&smooth, DiffuseForm::Irradiance);
        assert_eq!(layer.higher.unwrap().visible.order().get(), 4);
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
