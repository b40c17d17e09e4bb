//! Gauss-Legendre quadrature.

use std::f64::consts::PI;

/// Points and weights of a quadrature over an interval.
#[derive(Debug, Clone)]
pub(crate) struct Quadrature {
    /// Pairs for the interval -1 to 1.
    nodes: Vec<[f64; 2]>,
}

impl Quadrature {
    /// `count` points: exact for polynomials of degree `2 count - 1`.
    pub(crate) fn new(count: usize) -> Self {
        Self {
            nodes: (0..count).map(|at| node(count, at)).collect(),
        }
    }

    /// Enough points to integrate sines and cosines of up to `frequency` over an interval of `length`
    /// (radians) to the last bits.
    pub(crate) fn for_waves(frequency: usize, length: f64) -> Self {
        Self::new(12 + (frequency as f64 * length / 2.0).ceil() as usize)
    }

    /// Points from `from` to `to` and their weights.
    pub(crate) fn over(&self, from: f64, to: f64) -> impl Iterator<Item = [f64; 2]> {
        let (middle, half) = (from.midpoint(to), (to - from) / 2.0);
        self.nodes
            .iter()
            .map(move |[at, weight]| [middle + half * at, half * weight])
    }
}

/// A zero of the Legendre polynomial of degree `count`, by Newton's method, and its weight.
fn node(count: usize, at: usize) -> [f64; 2] {
    let mut x = (PI * (at as f64 + 0.75) / (count as f64 + 0.5)).cos();
    // Converges from this start in four or five steps.
    for _ in 0..8 {
        let [value, derivative] = legendre(count, x);
        x -= value / derivative;
    }
    let [_, derivative] = legendre(count, x);
    [x, 2.0 / ((1.0 - x * x) * derivative * derivative)]
}

/// The Legendre polynomial and its derivative.
fn legendre(degree: usize, x: f64) -> [f64; 2] {
    let (mut before, mut now) = (0.0, 1.0);
    for k in 1..=degree {
        let k = k as f64;
        (before, now) = (now, ((2.0 * k - 1.0) * x * now - (k - 1.0) * before) / k);
    }
    [now, degree as f64 * (x * now - before) / (x * x - 1.0)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_twice_the_count_are_exact() {
        let quadrature = Quadrature::new(5);
        let sum: f64 = quadrature.over(0.0, 2.0).map(|[x, w]| w * x.powi(9)).sum();
        assert!((sum - 2.0_f64.powi(10) / 10.0).abs() < 1e-11);
    }

    #[test]
    fn waves_are_exact_to_the_last_bits() {
        for (frequency, length) in [(3, 0.01), (65, PI), (33, 1.0)] {
            let quadrature = Quadrature::for_waves(frequency, length);
            let k = frequency as f64;
            let sum: f64 = quadrature
                .over(0.0, length)
                .map(|[x, w]| w * (k * x).cos())
                .sum();
            assert!(
                (sum - (k * length).sin() / k).abs() < 1e-14,
                "{frequency} {length}"
            );
        }
    }
}
