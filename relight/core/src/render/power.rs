//! The specular layer as the paper writes it.

use super::diffuse::COSINE_LOBE;
use super::simd::{Kernel, Lanes, Number};
use super::surface::Gloss;
use crate::image::{ImageError, Linear, Rgb};
use crate::light::{Normals, ShLight};

/// The specular layer of the paper's section 4.2.2 for one light:
/// H(n) = s_p Σ C_lm (Â_l Ŷ_lm(n))^α, where Ŷ is Y at twice the polar angle.
///
/// What is raised to the power α is negative for half of the normals, where a real power is not
/// defined. Here it is sign(v) |v|^α: odd like the harmonics of band 1, and smooth through 0. H itself may
/// become negative; it is passed on as it is.
///
/// A power of a sum's terms is not the power of the sum: it approximates the Blinn-Phong highlight
/// only for small α, and its size depends on α by orders of magnitude. It serves to compare results with the
/// paper's; [`LobeLayer`](super::LobeLayer) is close to the ground truth.
///
/// ```
/// use relight_core::light::{Normals, Order, ShLight};
/// use relight_core::render::{Gloss, PowerLayer};
///
/// let normals = Normals::sphere(9);
/// let layer = PowerLayer::new(&ShLight::even(Order::TWO, [1.0; 3]));
/// let highlight = layer.highlight(&normals, &Gloss::even(normals.extent(), [1.0; 3], 2.0))?;
/// // C_00 (π Y_00)^2 = π^2 Y_00 where the radiance is 1.
/// assert!((highlight.planes().pixel(4, 4)[0] - 2.7842).abs() < 1e-3);
/// # Ok::<(), relight_core::image::ImageError>(())
/// ```
#[derive(Debug, Clone)]
pub struct PowerLayer {
    coefficients: [[f64; 3]; 9],
}

impl PowerLayer {
    /// The layer for a light; only its first nine coefficients count.
    pub fn new(light: &ShLight) -> Self {
        let mut coefficients = [[0.0; 3]; 9];
        for (to, from) in coefficients.iter_mut().zip(light.coefficients()) {
            *to = *from;
        }
        Self { coefficients }
    }

    /// The highlight H, 0 outside the object.
    ///
    /// # Errors
    /// If the maps differ in size.
    pub fn highlight(&self, normals: &Normals, gloss: &Gloss) -> Result<Rgb<Linear>, ImageError> {
        super::highlight(self, normals, gloss)
    }
}

impl Kernel<7, 3> for PowerLayer {
    type Scratch = ();

    fn scratch(&self) {}

    #[inline(always)]
    fn run(&self, (): &mut (), [x, y, z, red, green, blue, smoothness]: [Lanes; 7]) -> [Lanes; 3] {
        let [mut r, mut g, mut b] = [Lanes::all(0.0); 3];
        for (term, c) in terms([x, y, z]).iter().zip(&self.coefficients) {
            let power = term.signed_power(smoothness);
            r = r + power * Lanes::splat(c[0]);
            g = g + power * Lanes::splat(c[1]);
            b = b + power * Lanes::splat(c[2]);
        }
        let surface = Lanes::surface([x, y, z]);
        [r * red * surface, g * green * surface, b * blue * surface]
    }
}

/// c_0 to c_4 of the paper's list; c_4 is printed as c_5 there.
const C: [f64; 5] = [
    0.282_094_791_773_878_14,
    0.488_602_511_902_919_9,
    1.092_548_430_592_079_2,
    0.315_391_565_252_520_05,
    0.546_274_215_296_039_6,
];

/// Â_l Ŷ_lm(n): the paper's polynomials times the coefficients of the cosine lobe.
#[inline(always)]
fn terms<T: Number>([x, y, z]: [T; 3]) -> [T; 9] {
    let [c0, c1, c2, c3, c4] = power_constants().map(T::splat);
    let [one, two, three, four] = [1.0, 2.0, 3.0, 4.0].map(T::splat);
    let square = z * z;
    let odd = four * square * z - two * z;
    [
        c0,
        two * c1 * y * z,
        c1 * (two * square - one),
        two * c1 * x * z,
        four * c2 * x * y * square,
        c2 * y * odd,
        c3 * (three * (four * square * square - four * square + one) - one),
        c2 * x * odd,
        four * c4 * (x * x - y * y) * square,
    ]
}

/// The constants of the paper's polynomials, each times Â_l of its band.
#[inline(always)]
pub const fn power_constants() -> [f64; 5] {
    let [a0, a1, a2] = COSINE_LOBE;
    [a0 * C[0], a1 * C[1], a2 * C[2], a2 * C[3], a2 * C[4]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Direction, Order, basis};

    impl PowerLayer {
        /// The highlight of one unit normal, for s_p = 1.
        fn at(&self, normal: [f64; 3], smoothness: f64) -> [f64; 3] {
            let powers = terms(normal).map(|v| v.abs().powf(smoothness).copysign(v));
            [0, 1, 2].map(|channel| {
                let products = powers.iter().zip(&self.coefficients);
                products.map(|(power, c)| power * c[channel]).sum()
            })
        }
    }

    fn some_light() -> ShLight {
        let value = |i: usize| ((i * i + 1) as f64).sin();
        ShLight::new((0..9).map(|i| [value(i), value(i + 9), 0.4]).collect()).unwrap()
    }

    #[test]
    fn the_terms_are_the_harmonics_at_twice_the_polar_angle() {
        let (polar, azimuth) = (0.6, -1.3);
        let doubled = basis(Order::TWO, Direction::from_angles(2.0 * polar, azimuth));
        let ours = terms(Direction::from_angles(polar, azimuth).components());
        for (at, term) in ours.into_iter().enumerate() {
            let expected = COSINE_LOBE[at.isqrt()] * doubled[at];
            assert!((term - expected).abs() < 1e-12, "{at}: {term} {expected}");
        }
    }

    #[test]
    fn powers_keep_the_sign_of_what_is_raised() {
        let mut light = ShLight::dark(Order::TWO);
        light.coefficients_mut()[3] = [1.0; 3];
        let layer = PowerLayer::new(&light);
        let normal = |x: f64| [x, 0.0, 0.8];
        for smoothness in [2.0, 7.3] {
            let [right, left] = [0.6, -0.6].map(|x| layer.at(normal(x), smoothness)[0]);
            assert!(right > 0.0 && (right + left).abs() < 1e-12);
        }
    }

    #[test]
    fn an_image_has_the_highlight_of_each_of_its_normals() {
        let normals = Normals::sphere(33);
        let layer = PowerLayer::new(&some_light());
        for smoothness in [5.0, 60.0] {
            let gloss = Gloss::even(normals.extent(), [1.0, 0.5, 0.25], smoothness);
            let image = layer.highlight(&normals, &gloss).unwrap();
            for (x, y) in [(16, 16), (5, 9), (30, 20)] {
                let normal = normals.planes().pixel(x, y).map(f64::from);
                let exact = layer.at(normal, f64::from(smoothness));
                for (c, fast) in image.planes().pixel(x, y).into_iter().enumerate() {
                    let exact = exact[c] / [1.0, 2.0, 4.0][c];
                    let error = (f64::from(fast) - exact).abs();
                    assert!(
                        error < 1e-4 * exact.abs().max(0.1),
                        "{smoothness}: {fast} {exact}"
                    );
                }
            }
            assert_eq!(image.planes().pixel(0, 0), [0.0; 3]);
        }
    }
}
