//! The real spherical harmonics.

use std::f64::consts::{PI, SQRT_2};

use super::{Direction, Order};

/// The values of all real spherical harmonics up to `order` at a direction, coefficient (l, m) at
/// index `l (l + 1) + m`.
///
/// Orthonormal on the sphere, without the Condon-Shortley phase, pole at z (Green, *Spherical Harmonic
/// Lighting: The Gritty Details*, 2003; the paper's Y of section 4.2):
/// `Y_l^m` is `K P_l^m(z)` times `√2 cos mφ` for m > 0, 1 for m = 0, `√2 sin |m|φ` for m < 0.
///
/// ```
/// use relight_core::light::{Direction, Order, basis};
///
/// let values = basis(Order::TWO, Direction::RIGHT);
/// assert!((values[0] - 0.282_095).abs() < 1e-6); // Y_0
/// assert!((values[3] - 0.488_603).abs() < 1e-6); // Y_1^1, along x
/// assert!((values[8] - 0.546_274).abs() < 1e-6); // Y_2^2, x^2 - y^2
/// ```
pub fn basis(order: Order, direction: Direction) -> Vec<f64> {
    let mut values = vec![0.0; order.coefficients()];
    basis_into(order, direction.components(), &mut values);
    values
}

/// As [`basis`], for polynomials in x, y and z that are also defined off the unit sphere.
pub fn basis_into(order: Order, [x, y, z]: [f64; 3], values: &mut [f64]) {
    let top = order.get();
    let mut diagonal = (1.0 / (4.0 * PI)).sqrt();
    // The real and imaginary part of (x + iy)^m, with the √2 of m > 0.
    let (mut cos, mut sin) = (1.0, 0.0);
    for m in 0..=top {
        if m > 0 {
            diagonal *= (1.0 + 0.5 / m as f64).sqrt();
            let root = if m == 1 { SQRT_2 } else { 1.0 };
            (cos, sin) = (root * (cos * x - sin * y), root * (cos * y + sin * x));
        }
        let (mut before, mut now) = (0.0, diagonal);
        for l in m..=top {
            let middle = l * (l + 1);
            values[middle + m] = now * cos;
            if m > 0 {
                values[middle - m] = now * sin;
            }
            let [a, b] = legendre_step(l + 1, m);
            (before, now) = (now, a * z * now - b * before);
        }
    }
}

/// The parts of the spherical harmonics that depend on the polar angle alone, for m >= 0, at
/// `l (l + 1) / 2 + m`; without the √2 of m > 0, which belongs to the azimuth.
pub(crate) fn polar_functions(order: Order, polar: f64, values: &mut [f64]) {
    let (sin, z) = polar.sin_cos();
    let mut diagonal = (1.0 / (4.0 * PI)).sqrt();
    for m in 0..=order.get() {
        if m > 0 {
            diagonal *= sin * (1.0 + 0.5 / m as f64).sqrt();
        }
        let (mut before, mut now) = (0.0, diagonal);
        for l in m..=order.get() {
            values[l * (l + 1) / 2 + m] = now;
            let [a, b] = legendre_step(l + 1, m);
            (before, now) = (now, a * z * now - b * before);
        }
    }
}

/// The factors a and b of `Q_l^m = a z Q_{l-1}^m - b Q_{l-2}^m`, where Q is the normalised associated
/// Legendre function over sin^m, and l > m.
pub(crate) fn legendre_step(l: usize, m: usize) -> [f64; 2] {
    let (l, m) = (l as f64, m as f64);
    let root = |l: f64| ((4.0 * l * l - 1.0) / (l * l - m * m)).sqrt();
    let a = root(l);
    let b = if l - 1.0 > m { a / root(l - 1.0) } else { 0.0 };
    [a, b]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The list of the paper's section 4.2, at half its angle (and with the c_4 that it leaves out).
    fn as_written([x, y, z]: [f64; 3]) -> [f64; 9] {
        let (c0, c1, c2, c3, c4) = (0.282_095, 0.488_603, 1.092_548, 0.315_392, 0.546_274);
        [
            c0,
            c1 * y,
            c1 * z,
            c1 * x,
            c2 * x * y,
            c2 * y * z,
            c3 * (3.0 * z * z - 1.0),
            c2 * x * z,
            c4 * (x * x - y * y),
        ]
    }

    #[test]
    fn the_first_nine_are_the_papers() {
        for (polar, azimuth) in [(0.3, 1.0), (1.5, -2.0), (3.0, 0.2), (2.0, 4.0)] {
            let d = Direction::from_angles(polar, azimuth);
            let ours = basis(Order::TWO, d);
            for (a, b) in ours.iter().zip(as_written(d.components())) {
                assert!((a - b).abs() < 2e-6, "{ours:?}");
            }
        }
    }

    #[test]
    fn the_polar_parts_are_those_of_the_whole() {
        let order = Order::new(7).unwrap();
        let (polar, azimuth) = (2.2_f64, 0.7_f64);
        let whole = basis(order, Direction::from_angles(polar, azimuth));
        let mut parts = vec![0.0; 36];
        polar_functions(order, polar, &mut parts);
        for l in 0..=7 {
            assert!((whole[l * (l + 1)] - parts[l * (l + 1) / 2]).abs() < 1e-13);
            for m in 1..=l {
                let wave = SQRT_2 * (m as f64 * azimuth).cos();
                let part = parts[l * (l + 1) / 2 + m];
                assert!(
                    (whole[l * (l + 1) + m] - wave * part).abs() < 1e-13,
                    "{l} {m}"
                );
            }
        }
    }

    #[test]
    fn every_band_has_the_same_energy_in_every_direction() {
        // Unsöld's theorem: the squares of band l sum up to (2 l + 1) / 4π.
        let order = Order::new(Order::MAX).unwrap();
        let values = basis(order, Direction::new(0.3, -0.8, 0.4).unwrap());
        for l in 0..=Order::MAX {
            let band = &values[l * l..(l + 1) * (l + 1)];
            let energy: f64 = band.iter().map(|v| v * v).sum();
            let expected = (2 * l + 1) as f64 / (4.0 * PI);
            assert!((energy / expected - 1.0).abs() < 1e-11, "band {l}");
        }
    }
}
