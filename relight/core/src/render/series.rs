//! Series of spherical harmonics with a weight a band, at a normal: Σ w_l G_lm Y_lm(n). Both layers are such
//! series; this knows nothing of what their coefficients mean.

use std::f64::consts::PI;

use super::simd::{Lanes, Number};
use crate::light::{Order, legendre_step};

/// The coefficients G_lm of a series, in both precisions.
#[derive(Debug, Clone)]
pub(super) struct HarmonicSeries {
    order: Order,
    exact: Vec<Term<f64>>,
    fast: Vec<Term<f32>>,
}

/// A pair of coefficients, (l, m) and (l, -m), and the step of the recurrence from l to l + 1.
/// Terms stand by m, then by l from m on.
#[derive(Debug, Clone)]
struct Term<F> {
    plus: [F; 3],
    minus: [F; 3],
    step: [F; 2],
    /// Whether both are 0, as in the odd bands of irradiance.
    is_dark: bool,
}

impl HarmonicSeries {
    /// The series of these coefficients, as many as the order has.
    pub(super) fn new(order: Order, coefficients: &[[f64; 3]]) -> Self {
        let exact = terms(order, coefficients);
        Self {
            order,
            fast: exact.iter().map(Term::rounded).collect(),
            exact,
        }
    }

    /// The last band.
    pub(super) const fn order(&self) -> Order {
        self.order
    }

    /// The sum at a unit normal, with a weight for each band.
    pub(super) fn at(&self, weights: &[f64], normal: [f64; 3]) -> [f64; 3] {
        sum(self.order, &self.exact, weights, normal)
    }

    /// The sum at several unit normals, in single precision.
    #[inline(always)]
    pub(super) fn at_lanes(&self, weights: &[Lanes], normal: [Lanes; 3]) -> [Lanes; 3] {
        sum(self.order, &self.fast, weights, normal)
    }
}

/// Σ w_l G_lm Y_lm(n)
#[inline(always)]
fn sum<T: Number>(
    order: Order,
    mut terms: &[Term<T::Constant>],
    weights: &[T],
    [x, y, z]: [T; 3],
) -> [T; 3] {
    let mut total = [T::splat(0.0); 3];
    let (mut cos, mut sin) = (T::splat(1.0), T::splat(0.0));
    let mut first = (1.0 / (4.0 * PI)).sqrt();
    for m in 0..=order.get() {
        if m > 0 {
            (cos, sin) = (cos * x - sin * y, cos * y + sin * x);
            first *= diagonal_step(m);
        }
        let (band, rest) = terms.split_at(order.get() + 1 - m);
        terms = rest;
        let [plus, minus] = sum_of_m(band, &weights[m..], first, z);
        for c in 0..3 {
            total[c] = total[c] + cos * plus[c] + sin * minus[c];
        }
    }
    total
}

/// Σ w_l Q_l^m(z) G_lm over l, for m and for -m. Q is the normalised associated Legendre function over
/// sin^m, which begins with `first`.
#[inline(always)]
fn sum_of_m<T: Number>(band: &[Term<T::Constant>], weights: &[T], first: f64, z: T) -> [[T; 3]; 2] {
    let [mut plus, mut minus] = [[T::splat(0.0); 3]; 2];
    let (mut before, mut now) = (T::splat(0.0), T::splat(first));
    for (term, factor) in band.iter().zip(weights) {
        if !term.is_dark {
            let weight = *factor * now;
            for c in 0..3 {
                plus[c] = plus[c] + weight * T::constant(term.plus[c]);
                minus[c] = minus[c] + weight * T::constant(term.minus[c]);
            }
        }
        let (a, b) = (T::constant(term.step[0]), T::constant(term.step[1]));
        (before, now) = (now, a * z * now - b * before);
    }
    [plus, minus]
}

/// By what Q_m^m, with the √2 of m > 0, is larger than that of m - 1.
fn diagonal_step(m: usize) -> f64 {
    let root = if m == 1 { 2.0_f64 } else { 1.0 };
    (root * (1.0 + 0.5 / m as f64)).sqrt()
}

fn terms(order: Order, coefficients: &[[f64; 3]]) -> Vec<Term<f64>> {
    let pairs = (0..=order.get()).flat_map(|m| (m..=order.get()).map(move |l| (l, m)));
    let term = |(l, m): (usize, usize)| {
        let middle = l * (l + 1);
        let plus = coefficients[middle + m];
        let minus = match m {
            0 => [0.0; 3],
            _ => coefficients[middle - m],
        };
        Term {
            plus,
            minus,
            step: legendre_step(l + 1, m),
            is_dark: [plus, minus] == [[0.0; 3]; 2],
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
            is_dark: self.is_dark,
        }
    }
}
