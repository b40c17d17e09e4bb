//! The normal equations of a joint step, with every pixel's normal and albedo eliminated.

use relight_core::light::NormalEquations;

use crate::fit::curve_statistics::CurveStatistics;
use crate::fit::normal_step::QuadraticCost;
use crate::fit::search::Search;
use crate::fit::unknowns::Unknowns;
use crate::model::directions::tangents;
use crate::model::harmonics::COEFFICIENTS;

/// The normal equations of the unknowns, without what the pixels do by themselves.
pub(crate) struct JointEquations {
    count: usize,
    /// The lower triangle, row by row, in a square.
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl JointEquations {
    pub(crate) fn new(count: usize) -> Self {
        Self {
            count,
            matrix: vec![0.0; count * count],
            right: vec![0.0; count],
        }
    }

    pub(crate) fn plus(mut self, other: Self) -> Self {
        let all = self.matrix.iter_mut().chain(&mut self.right);
        all.zip(other.matrix.into_iter().chain(other.right))
            .for_each(|(sum, value)| *sum += value);
        self
    }

    pub(crate) fn add_pixel(
        &mut self,
        search: &Search<'_>,
        unknowns: &Unknowns<'_>,
        (statistics, normal): (&CurveStatistics, [f64; 3]),
        weight: f64,
    ) {
        let axes = tangents(normal);
        let derivatives = search.derivatives(statistics, normal, axes);
        let mut quadratic = QuadraticCost::default();
        let mut couplings = vec![[0.0; 2]; self.count];
        let all = unknowns.columns(normal, derivatives.albedo);
        for (channel, mut columns) in all.into_iter().enumerate() {
            let (base, jacobian) = (&derivatives.base[channel], &derivatives.jacobian[channel]);
            quadratic.add(statistics, channel, jacobian, &derivatives.seen[channel]);
            let along = statistics.times(channel, base);
            let own = dot(base, &along);
            let rest = statistics.residual_products(channel, &derivatives.seen[channel]);
            if own > 1e-12 && derivatives.albedo[channel] > 0.0 {
                // The albedo follows.
                for (_, harmonics) in &mut columns {
                    let share = dot(harmonics, &along) / own;
                    harmonics
                        .iter_mut()
                        .zip(base)
                        .for_each(|(coefficient, base)| *coefficient -= share * base);
                }
            }
            for (k, (at, harmonics)) in columns.iter().enumerate() {
                let image = statistics.times(channel, harmonics);
                self.right[*at] += weight * dot(harmonics, &rest);
                for (coupling, column) in couplings[*at].iter_mut().zip(jacobian) {
                    *coupling += dot(column, &image);
                }
                for (other, harmonics) in &columns[..=k] {
                    self.matrix[at * self.count + other] += weight * dot(harmonics, &image);
                }
            }
        }
        quadratic.scale(statistics.unit());
        couplings
            .iter_mut()
            .flatten()
            .for_each(|value| *value *= statistics.unit());
        self.eliminate_normal(&quadratic, &couplings, weight / statistics.unit());
    }

    /// Eliminates the normal: what it could do as well is taken out (the Schur complement).
    pub(crate) fn eliminate_normal(
        &mut self,
        quadratic: &QuadraticCost,
        couplings: &[[f64; 2]],
        weight: f64,
    ) {
        let [uu, uv, vv] = quadratic.hessian;
        let more = 1e-6 * (uu + vv) + 1e-12;
        let (uu, vv) = (uu + more, vv + more);
        let determinant = uu * vv - uv * uv;
        let inverse = |[a, b]: [f64; 2]| {
            [
                weight * (vv * a - uv * b) / determinant,
                weight * (uu * b - uv * a) / determinant,
            ]
        };
        // What is kept is half the gradient: a step goes against it.
        let by_gradient = inverse(quadratic.gradient);
        for (i, row) in couplings.iter().enumerate() {
            let by_row = inverse(*row);
            self.right[i] += row[0] * by_gradient[0] + row[1] * by_gradient[1];
            for (j, other) in couplings[..=i].iter().enumerate() {
                self.matrix[i * self.count + j] -= by_row[0] * other[0] + by_row[1] * other[1];
            }
        }
    }

    /// The unknowns' change; each is held by this part of what holds it already.
    pub(crate) fn solve(self, damping: f64) -> Option<Vec<f64>> {
        let Self {
            count,
            matrix,
            right,
        } = self;
        // In units of what holds each: they are of very different sizes.
        let largest = (0..count)
            .map(|i| matrix[i * count + i])
            .fold(0.0, f64::max);
        let least = 1e-12 * largest + f64::MIN_POSITIVE;
        let units: Vec<f64> = (0..count)
            .map(|i| matrix[i * count + i].max(least).sqrt())
            .collect();
        let mut equations = NormalEquations::new(count);
        let product = |i: usize, j: usize| {
            let more = if i == j { damping } else { 0.0 };
            matrix[i * count + j] / (units[i] * units[j]) + more
        };
        equations.add_sums(product, |i| [right[i] / units[i], 0.0, 0.0]);
        let solution = equations.solve()?;
        let pairs = solution.into_iter().zip(units);
        Some(pairs.map(|([value, ..], unit)| value / unit).collect())
    }
}

fn dot(a: &[f64; COEFFICIENTS], b: &[f64; COEFFICIENTS]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
