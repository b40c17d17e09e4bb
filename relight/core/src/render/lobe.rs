//! A specular layer that comes close to the Blinn-Phong highlight: its lobe in zonal harmonics.

use std::f64::consts::PI;

use super::series::HarmonicSeries;
use super::simd::{Kernel, Lanes, Number};
use super::surface::Gloss;
use crate::image::{ImageError, Linear, Rgb};
use crate::light::{Normals, Order, Quadrature, ShLight, polar_functions};

/// A specular layer for one light, of any order: H(n) = s_p ∫ L(ω) max(0, n·b)^α dω, where b is half way
/// between ω and the viewer.
///
/// In the half vector b the lobe max(0, n·b)^α depends on the angle between n and b alone, so the
/// integral is a convolution on the sphere once the light is written as a function of b:
///
/// - b has the azimuth of ω and half its polar angle, so dω = 4 (b·v) db, and the light becomes
///   G(b) = 4 (b·v) L(2θ_b, φ_b) on the viewer's half of the sphere, 0 on the other. Its coefficients
///   G_lm follow from those of the light by a fixed matrix for each m.
/// - The lobe's zonal coefficients are k_l(α) = 2π ∫ t^α P_l(t) dt over 0..1: k_0 = 2π / (α + 1),
///   k_1 = 2π / (α + 2), k_l = k_(l-2) (α - l + 2) / (α + l + 1).
/// - H(n) = s_p Σ k_l(α) G_lm Y_lm(n) (Funk-Hecke), where negative ringing is cut off.
///
/// The light's bands beyond its order are lost, and those of G beyond the layer's.
///
/// ```
/// use relight_core::light::{Normals, Order, ShLight};
/// use relight_core::render::{Gloss, LobeLayer};
///
/// let normals = Normals::sphere(9);
/// let layer = LobeLayer::new(&ShLight::even(Order::TWO, [1.0; 3]));
/// let highlight = layer.highlight(&normals, &Gloss::even(normals.extent(), [0.5; 3], 20.0))?;
/// // Even light, seen by a normal towards the viewer: 0.5 * 8π / (α + 2).
/// assert!((highlight.planes().pixel(4, 4)[0] - 0.571).abs() < 2e-3);
/// # Ok::<(), relight_core::image::ImageError>(())
/// ```
#[derive(Debug, Clone)]
pub struct LobeLayer {
    order: Order,
    series: HarmonicSeries,
}

impl LobeLayer {
    /// How many bands G has beyond those of the light: with these, light of order 2 is rendered to 1 % of
    /// the highlight for α up to 200.
    const MORE_BANDS: usize = 8;

    /// The layer for a light, with enough bands for what the light holds.
    pub fn new(light: &ShLight) -> Self {
        let order = light.order().get() + Self::MORE_BANDS;
        Self::with_order(light, Order::new(order).unwrap_or(Order::HIGHEST))
    }

    /// The layer whose G ends at band `order`.
    pub fn with_order(light: &ShLight, order: Order) -> Self {
        let half = Transfer::new(light.order(), order).apply(light);
        Self {
            order,
            series: HarmonicSeries::new(order, &half),
        }
    }

    /// The highlight H, 0 outside the object.
    ///
    /// # Errors
    /// If the maps differ in size.
    pub fn highlight(&self, normals: &Normals, gloss: &Gloss) -> Result<Rgb<Linear>, ImageError> {
        super::highlight(self, normals, gloss)
    }
}

impl Kernel<7, 3> for LobeLayer {
    type Scratch = Vec<Lanes>;

    fn scratch(&self) -> Self::Scratch {
        vec![Lanes::all(0.0); self.order.get() + 1]
    }

    #[inline(always)]
    fn run(
        &self,
        lobe: &mut Self::Scratch,
        [x, y, z, red, green, blue, smoothness]: [Lanes; 7],
    ) -> [Lanes; 3] {
        zonal(smoothness, lobe);
        let [r, g, b] = self.series.at_lanes(lobe, [x, y, z]);
        let surface = Lanes::surface([x, y, z]);
        [
            r.at_least_zero() * red * surface,
            g.at_least_zero() * green * surface,
            b.at_least_zero() * blue * surface,
        ]
    }
}

/// The zonal coefficients of the lobe, k_l(α).
#[inline(always)]
fn zonal<T: Number>(smoothness: T, lobe: &mut [T]) {
    for l in 0..lobe.len() {
        let degree = l as f64;
        lobe[l] = if l < 2 {
            T::splat(2.0 * PI) / (smoothness + T::splat(degree + 1.0))
        } else {
            lobe[l - 2] * (smoothness + T::splat(2.0 - degree))
                / (smoothness + T::splat(degree + 1.0))
        };
    }
}

/// From the coefficients of light to those of G: a matrix for each |m|.
#[derive(Debug, Clone)]
struct Transfer {
    from: Order,
    to: Order,
    /// For each |m|, rows l' = m..=to, columns l = m..=from.
    matrices: Vec<Vec<f64>>,
}

impl Transfer {
    fn new(from: Order, to: Order) -> Self {
        let size = |order: Order| (order.get() + 1) * (order.get() + 2) / 2;
        let (mut light, mut half) = (vec![0.0; size(from)], vec![0.0; size(to)]);
        let mut matrices: Vec<Vec<f64>> = (0..=from.get().min(to.get()))
            .map(|m| vec![0.0; (to.get() + 1 - m) * (from.get() + 1 - m)])
            .collect();
        let quadrature = Quadrature::for_waves(2 * from.get() + to.get() + 2, PI / 2.0);
        for [polar, weight] in quadrature.over(0.0, PI / 2.0) {
            polar_functions(from, 2.0 * polar, &mut light);
            polar_functions(to, polar, &mut half);
            let area = 2.0 * PI * 4.0 * polar.cos() * polar.sin() * weight;
            for (m, matrix) in matrices.iter_mut().enumerate() {
                let mut cells = matrix.iter_mut();
                for l_half in m..=to.get() {
                    let factor = area * half[l_half * (l_half + 1) / 2 + m];
                    for (l, cell) in (m..=from.get()).zip(cells.by_ref()) {
                        *cell += factor * light[l * (l + 1) / 2 + m];
                    }
                }
            }
        }
        Self { from, to, matrices }
    }

    /// Pairs of indices, to and from, with the factor.
    fn cells(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.matrices
            .iter()
            .enumerate()
            .flat_map(move |(m, matrix)| {
                let columns = self.from.get() + 1 - m;
                matrix.iter().enumerate().flat_map(move |(at, &factor)| {
                    let (to, from) = (m + at / columns, m + at % columns);
                    let pair = move |m: isize| {
                        let index = |l: usize| (l * (l + 1)).wrapping_add_signed(m);
                        (index(to), index(from), factor)
                    };
                    let m = m as isize;
                    [Some(pair(m)), (m > 0).then(|| pair(-m))]
                        .into_iter()
                        .flatten()
                })
            })
    }

    fn apply(&self, light: &ShLight) -> Vec<[f64; 3]> {
        let mut half = vec![[0.0; 3]; self.to.coefficients()];
        for (to, from, factor) in self.cells() {
            for (sum, c) in half[to].iter_mut().zip(light.coefficients()[from]) {
                *sum += factor * c;
            }
        }
        half
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::{Direction, basis};

    impl LobeLayer {
        /// The highlight of one unit normal, for s_p = 1.
        fn at(&self, normal: [f64; 3], smoothness: f64) -> [f64; 3] {
            let mut lobe = vec![0.0; self.order.get() + 1];
            zonal(smoothness, &mut lobe);
            self.series.at(&lobe, normal).map(|sum| sum.max(0.0))
        }
    }

    fn some_light(order: usize) -> ShLight {
        let count = Order::new(order).unwrap().coefficients();
        let value = |i: usize| ((i * i + 1) as f64).sin() / (i + 1) as f64;
        let mut values: Vec<_> = (0..count).map(|i| [value(i), value(i + 9), 0.3]).collect();
        values[0] = [4.0, 3.0, 5.0];
        ShLight::new(values).unwrap()
    }

    /// The highlight by quadrature over the half vectors.
    fn integral(light: &ShLight, normal: Direction, smoothness: f64) -> [f64; 3] {
        let (rows, columns) = (200, 300);
        let mut sum = [0.0; 3];
        for i in 0..rows {
            let polar = PI / 2.0 * (f64::from(i) + 0.5) / f64::from(rows);
            let area = polar.sin() * PI / 2.0 / f64::from(rows) * 2.0 * PI / f64::from(columns);
            for j in 0..columns {
                let azimuth = 2.0 * PI * f64::from(j) / f64::from(columns);
                let half = Direction::from_angles(polar, azimuth);
                let lobe = normal.dot(half).max(0.0).powf(smoothness);
                let radiance = light.radiance(Direction::from_angles(2.0 * polar, azimuth));
                for (sum, r) in sum.iter_mut().zip(radiance) {
                    *sum += area * 4.0 * polar.cos() * lobe * r;
                }
            }
        }
        sum
    }

    #[test]
    fn the_layer_is_the_integral_of_the_lobe() {
        for (order, smoothness) in [(2, 5.0), (2, 50.0), (2, 200.0), (6, 30.0)] {
            let light = some_light(order);
            let layer = LobeLayer::new(&light);
            for (x, y, z) in [(0.0, 0.0, 1.0), (0.5, -0.3, 0.6), (-0.9, 0.1, 0.3)] {
                let normal = Direction::new(x, y, z).unwrap();
                let truth = integral(&light, normal, smoothness);
                let ours = layer.at(normal.components(), smoothness);
                for (a, b) in ours.iter().zip(truth) {
                    assert!(
                        (a - b).abs() < 0.01 * truth[2],
                        "{order} {smoothness}: {a} {b}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_lobe_s_coefficients_are_its_integrals_with_the_legendre_polynomials() {
        let mut lobe = [0.0; 6];
        for smoothness in [0.5, 3.0, 70.0] {
            zonal(smoothness, &mut lobe);
            for (l, coefficient) in lobe.iter().enumerate() {
                let steps = 20_000;
                let point = |i: i32| (f64::from(i) + 0.5) / f64::from(steps);
                let values = (0..steps).map(point).map(|t: f64| {
                    let zonal = basis(
                        Order::new(5).unwrap(),
                        Direction::from_angles(t.acos(), 0.0),
                    );
                    let norm = (4.0 * PI / (2 * l + 1) as f64).sqrt();
                    t.powf(smoothness) * zonal[l * (l + 1)] * norm
                });
                let integral = 2.0 * PI * values.sum::<f64>() / f64::from(steps);
                assert!((coefficient - integral).abs() < 1e-5, "{l} {smoothness}");
            }
        }
    }

    #[test]
    fn an_image_has_the_highlight_of_each_of_its_normals() {
        let normals = Normals::sphere(33);
        for order in [2, 20] {
            let layer = LobeLayer::new(&some_light(order));
            let gloss = Gloss::even(normals.extent(), [1.0, 0.5, 0.25], 60.0);
            let image = layer.highlight(&normals, &gloss).unwrap();
            for (x, y) in [(16, 16), (5, 9), (30, 20)] {
                let exact = layer.at(normals.planes().pixel(x, y).map(f64::from), 60.0);
                for (c, fast) in image.planes().pixel(x, y).into_iter().enumerate() {
                    let exact = exact[c] / [1.0, 2.0, 4.0][c];
                    assert!(
                        (f64::from(fast) - exact).abs() < 1e-5,
                        "{order}: {fast} {exact}"
                    );
                }
            }
            assert_eq!(image.planes().pixel(0, 0), [0.0; 3]);
        }
    }
}
