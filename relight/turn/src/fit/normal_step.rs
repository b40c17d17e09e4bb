//! How the cost of a normal changes as it leans.

use crate::fit::curve_statistics::{CurveStatistics, sum_of_products};
use crate::model::harmonics::COEFFICIENTS;

/// Longest step of a normal, radians. By hand.
const LONGEST_STEP: f64 = 0.2;

/// The harmonics of a pixel, channel by channel, and how they change as its normal leans.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NormalDerivatives {
    pub(crate) albedo: [f64; 3],
    /// Those of its base layer, for an albedo of 1.
    pub(crate) base: [[f64; COEFFICIENTS]; 3],
    /// Those of all that is seen.
    pub(crate) seen: [[f64; COEFFICIENTS]; 3],
    /// The change of the latter with a normal that leans to either side, while the albedo follows.
    pub(crate) jacobian: [[[f64; COEFFICIENTS]; 2]; 3],
}

/// Half the gradient of the cost over two leanings, and half its second derivative.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct QuadraticCost {
    pub(crate) gradient: [f64; 2],
    /// uu, uv, vv.
    pub(crate) hessian: [f64; 3],
}

impl QuadraticCost {
    pub(crate) fn add(
        &mut self,
        statistics: &CurveStatistics,
        channel: usize,
        [u, v]: &[[f64; COEFFICIENTS]; 2],
        seen: &[f64; COEFFICIENTS],
    ) {
        let rest = statistics.residual_products(channel, seen);
        for (gradient, column) in self.gradient.iter_mut().zip([u, v]) {
            *gradient -= sum_of_products(column, &rest);
        }
        let [of_u, of_v] = [u, v].map(|column| statistics.times(channel, column));
        for (hessian, (a, b)) in self
            .hessian
            .iter_mut()
            .zip([(u, of_u), (u, of_v), (v, of_v)])
        {
            *hessian += sum_of_products(a, &b);
        }
    }

    pub(crate) fn scale(&mut self, factor: f64) {
        self.gradient.iter_mut().for_each(|value| *value *= factor);
        self.hessian.iter_mut().for_each(|value| *value *= factor);
    }

    /// The step to the least cost, were it a parabola.
    pub(crate) fn step(&self, damping: f64) -> [f64; 2] {
        let [uu, uv, vv] = self.hessian;
        let more = damping * (uu + vv) + 1e-12;
        let (uu, vv) = (uu + more, vv + more);
        let determinant = uu * vv - uv * uv;
        let [a, b] = self.gradient;
        let step = [
            (uv * b - vv * a) / determinant,
            (uv * a - uu * b) / determinant,
        ];
        let length = step[0].hypot(step[1]);
        if length > LONGEST_STEP {
            step.map(|value| value * LONGEST_STEP / length)
        } else {
            step
        }
    }
}
