//! A specular layer that comes close to the Blinn-Phong highlight: its lobe in zonal harmonics.

use std::f64::consts::PI;

use super::Specular;
use super::lanes::{Kernel, Lanes, Number};
use super::surface::Gloss;
use crate::image::{ImageError, Linear, Rgb};

use crate::light::{
    Normals, Order, Quadrature, ShLight, YUp, basis_into, legendre_step, polar_functions,
};

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
/// What is lost are the bands of the light beyond its order, and those of G beyond the layer's.
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
    light_order: Order,
    transfer: Transfer,
    exact: Vec<Term<f64>>,
    fast: Vec<Term<f32>>,
}

/// A pair of coefficients of G, (l, m) and (l, -m), and the step of the recurrence from l to l + 1.
/// Terms stand by m, then by l from m on.
#[derive(Debug, Clone)]
struct Term<F> {
    plus: [F; 3],
    minus: [F; 3],
    step: [F; 2],
}

impl LobeLayer {
    /// How many bands G has beyond those of the light: with these, light of order 2 is rendered to 1 % of
    /// the highlight for α up to 200.
    const MORE_BANDS: usize = 8;

    /// The layer for a light, with enough bands for what the light holds.
    #[must_use]
    pub fn new(light: &ShLight) -> Self {
        let order = light.order().get() + Self::MORE_BANDS;
        Self::with_order(light, Order::new(order).unwrap_or(Order::HIGHEST))
    }

    /// The layer whose G ends at band `order`.
    #[must_use]
    pub fn with_order(light: &ShLight, order: Order) -> Self {
        let transfer = Transfer::new(light.order(), order);
        let exact = terms(order, &transfer.apply(light));
        Self {
            order,
            light_order: light.order(),
            transfer,
            fast: exact.iter().map(Term::rounded).collect(),
            exact,
        }
    }

    /// The highlight H, 0 where there is no surface.
    ///
    /// # Errors
    /// Where the maps differ in size.
    pub fn highlight(
        &self,
        normals: &Normals<YUp>,
        gloss: &Gloss,
    ) -> Result<Rgb<Linear>, ImageError> {
        super::highlight(self, normals, gloss)
    }
}

impl Specular for LobeLayer {
    fn light_order(&self) -> Order {
        self.light_order
    }

    fn at(&self, normal: [f64; 3], smoothness: f64) -> [f64; 3] {
        let mut lobe = vec![0.0; self.order.get() + 1];
        zonal(smoothness, &mut lobe);
        sum(self.order, &self.exact, &lobe, normal).map(|sum| sum.max(0.0))
    }

    fn backward(
        &self,
        normal: [f64; 3],
        smoothness: f64,
        upstream: [f64; 3],
        light: &mut [[f64; 3]],
    ) -> ([f64; 3], f64) {
        let mut lobe = vec![0.0; self.order.get() + 1];
        zonal(smoothness, &mut lobe);
        let sums = sum(self.order, &self.exact, &lobe, normal);
        let upstream = [0, 1, 2].map(|c| if sums[c] > 0.0 { upstream[c] } else { 0.0 });
        let weigh = |v: [f64; 3]| v[0] * upstream[0] + v[1] * upstream[1] + v[2] * upstream[2];

        let by_lobe = sum(
            self.order,
            &self.exact,
            &zonal_derivatives(smoothness, &lobe),
            normal,
        );
        self.pass_to_light(normal, &lobe, upstream, light);
        (self.gradient(&lobe, normal).map(weigh), weigh(by_lobe))
    }
}

impl LobeLayer {
    /// Adds the derivatives by the light's coefficients.
    fn pass_to_light(
        &self,
        normal: [f64; 3],
        lobe: &[f64],
        upstream: [f64; 3],
        light: &mut [[f64; 3]],
    ) {
        let mut values = vec![0.0; self.order.coefficients()];
        basis_into(self.order, normal, &mut values);
        for (to, from, factor) in self.transfer.cells() {
            let weight = factor * values[to] * lobe[to.isqrt()];
            for (sum, upstream) in light[from].iter_mut().zip(upstream) {
                *sum += weight * upstream;
            }
        }
    }

    /// The derivatives of the three sums by x, y and z of the normal.
    fn gradient(&self, lobe: &[f64], [x, y, z]: [f64; 3]) -> [[f64; 3]; 3] {
        let mut gradients = [[0.0; 3]; 3];
        let (mut cos, mut sin) = ([0.0, 1.0], [0.0, 0.0]);
        let mut terms = self.exact.as_slice();
        for m in 0..=self.order.get() {
            if m > 0 {
                let power = |re: [f64; 2], im: [f64; 2]| re[1] * x - im[1] * y;
                (cos, sin) = ([cos[1], power(cos, sin)], [sin[1], sin[1] * x + cos[1] * y]);
            }
            let (band, rest) = terms.split_at(self.order.get() + 1 - m);
            terms = rest;
            let [plus, minus] = sum_of_m(band, &lobe[m..], diagonal(m), z);
            let [plus_z, minus_z] = gradient_of_m(band, &lobe[m..], diagonal(m), z);
            // The derivatives of (x + iy)^m are m (x + iy)^(m - 1) and i times that.
            let [cos_before, sin_before] = [cos[0], sin[0]].map(|v| v * m as f64);
            for c in 0..3 {
                gradients[0][c] += cos_before * plus[c] + sin_before * minus[c];
                gradients[1][c] += cos_before * minus[c] - sin_before * plus[c];
                gradients[2][c] += cos[1] * plus_z[c] + sin[1] * minus_z[c];
            }
        }
        gradients
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
        let [r, g, b] = sum(self.order, &self.fast, lobe, [x, y, z]);
        let surface = Lanes::surface([x, y, z]);
        [
            r.at_least_zero() * red * surface,
            g.at_least_zero() * green * surface,
            b.at_least_zero() * blue * surface,
        ]
    }
}

/// Σ lobe_l G_lm Y_lm(n)
#[inline(always)]
fn sum<T: Number>(
    order: Order,
    mut terms: &[Term<T::Constant>],
    lobe: &[T],
    [x, y, z]: [T; 3],
) -> [T; 3] {
    let mut total = [T::of(0.0); 3];
    let (mut cos, mut sin) = (T::of(1.0), T::of(0.0));
    let mut first = diagonal(0);
    for m in 0..=order.get() {
        if m > 0 {
            (cos, sin) = (cos * x - sin * y, cos * y + sin * x);
            first *= diagonal_step(m);
        }
        let (band, rest) = terms.split_at(order.get() + 1 - m);
        terms = rest;
        let [plus, minus] = sum_of_m(band, &lobe[m..], first, z);
        for c in 0..3 {
            total[c] = total[c] + cos * plus[c] + sin * minus[c];
        }
    }
    total
}

/// Σ lobe_l Q_l^m(z) G_lm over l, for m and for -m. Q is the normalised associated Legendre function over
/// sin^m, which begins with `first`.
#[inline(always)]
fn sum_of_m<T: Number>(band: &[Term<T::Constant>], lobe: &[T], first: f64, z: T) -> [[T; 3]; 2] {
    let [mut plus, mut minus] = [[T::of(0.0); 3]; 2];
    let (mut before, mut now) = (T::of(0.0), T::of(first));
    for (term, factor) in band.iter().zip(lobe) {
        let weight = *factor * now;
        for c in 0..3 {
            plus[c] = plus[c] + weight * T::constant(term.plus[c]);
            minus[c] = minus[c] + weight * T::constant(term.minus[c]);
        }
        let (a, b) = (T::constant(term.step[0]), T::constant(term.step[1]));
        (before, now) = (now, a * z * now - b * before);
    }
    [plus, minus]
}

/// The derivative of [`sum_of_m`] by z.
fn gradient_of_m(band: &[Term<f64>], lobe: &[f64], first: f64, z: f64) -> [[f64; 3]; 2] {
    let [mut plus, mut minus] = [[0.0; 3]; 2];
    let (mut before, mut now) = ([0.0, 0.0], [first, 0.0]);
    for (term, factor) in band.iter().zip(lobe) {
        for c in 0..3 {
            plus[c] += factor * now[1] * term.plus[c];
            minus[c] += factor * now[1] * term.minus[c];
        }
        let [a, b] = term.step;
        let next = [
            a * z * now[0] - b * before[0],
            a * (now[0] + z * now[1]) - b * before[1],
        ];
        (before, now) = (now, next);
    }
    [plus, minus]
}

/// Q_m^m, with the √2 of m > 0.
fn diagonal(m: usize) -> f64 {
    (1..=m).fold((1.0 / (4.0 * PI)).sqrt(), |value, m| {
        value * diagonal_step(m)
    })
}

fn diagonal_step(m: usize) -> f64 {
    let root = if m == 1 { 2.0_f64 } else { 1.0 };
    (root * (1.0 + 0.5 / m as f64)).sqrt()
}

fn terms(order: Order, half: &[[f64; 3]]) -> Vec<Term<f64>> {
    let pairs = (0..=order.get()).flat_map(|m| (m..=order.get()).map(move |l| (l, m)));
    let term = |(l, m): (usize, usize)| {
        let middle = l * (l + 1);
        Term {
            plus: half[middle + m],
            minus: if m == 0 { [0.0; 3] } else { half[middle - m] },
            step: legendre_step(l + 1, m),
        }
    };
    pairs.map(term).collect()
}

impl Term<f64> {
    fn rounded(&self) -> Term<f32> {
        Term {
            plus: self.plus.map(|v| v as f32),
            minus: self.minus.map(|v| v as f32),
            step: self.step.map(|v| v as f32),
        }
    }
}

/// The zonal coefficients of the lobe, k_l(α).
#[inline(always)]
fn zonal<T: Number>(smoothness: T, lobe: &mut [T]) {
    for l in 0..lobe.len() {
        let degree = l as f64;
        lobe[l] = if l < 2 {
            T::of(2.0 * PI) / (smoothness + T::of(degree + 1.0))
        } else {
            lobe[l - 2] * (smoothness + T::of(2.0 - degree)) / (smoothness + T::of(degree + 1.0))
        };
    }
}

/// The derivatives of the zonal coefficients by α.
fn zonal_derivatives(smoothness: f64, lobe: &[f64]) -> Vec<f64> {
    let mut gradients = vec![0.0; lobe.len()];
    for l in 0..lobe.len() {
        let degree = l as f64;
        let below = smoothness + degree + 1.0;
        gradients[l] = if l < 2 {
            -lobe[l] / below
        } else {
            let above = smoothness + 2.0 - degree;
            (gradients[l - 2] * above + lobe[l - 2] - lobe[l]) / below
        };
    }
    gradients
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
