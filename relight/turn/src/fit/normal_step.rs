//! How the cost of a normal changes as it leans.

use crate::fit::curve_statistics::Moments;
use crate::fit::curve_statistics::sum_of_products;
use crate::model::directions::dot;
use crate::model::harmonics::WAVES;

/// Parameters of a step of a normal.
struct NormalStepParameters {
    /// Longest step of a normal, radians. By hand.
    longest_step: f64,
}

const PARAMETERS: NormalStepParameters = NormalStepParameters { longest_step: 0.2 };

/// A normal of the viewer's frame, where a network or a shape expects it, and how much that counts:
/// `weight (1 - cos)` is added to the residual.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Expected {
    pub(crate) normal: [f64; 3],
    pub(crate) weight: f64,
}

/// The waves of a pixel, channel by channel, and how they change as its normal leans.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Leaning {
    pub(crate) albedo: [f64; 3],
    /// Those of its body, for an albedo of 1.
    pub(crate) body: [[f64; WAVES]; 3],
    /// Those of all that is seen.
    pub(crate) seen: [[f64; WAVES]; 3],
    /// The change of the latter with a normal that leans to either side, while the albedo follows.
    pub(crate) ways: [[[f64; WAVES]; 2]; 3],
}

/// Half the gradient of the cost over two leanings, and half its second derivative.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Slope {
    pub(crate) gradient: [f64; 2],
    /// uu, uv, vv.
    pub(crate) bend: [f64; 3],
}

impl Slope {
    pub(crate) fn add(
        &mut self,
        moments: &Moments,
        channel: usize,
        [u, v]: &[[f64; WAVES]; 2],
        seen: &[f64; WAVES],
    ) {
        let rest = moments.rest(channel, seen);
        for (gradient, way) in self.gradient.iter_mut().zip([u, v]) {
            *gradient -= sum_of_products(way, &rest);
        }
        let [of_u, of_v] = [u, v].map(|way| moments.times(channel, way));
        for (bend, (a, b)) in self.bend.iter_mut().zip([(u, of_u), (u, of_v), (v, of_v)]) {
            *bend += sum_of_products(a, &b);
        }
    }

    pub(crate) fn scale(&mut self, factor: f64) {
        self.gradient.iter_mut().for_each(|value| *value *= factor);
        self.bend.iter_mut().for_each(|value| *value *= factor);
    }

    /// Adds the prior's part.
    pub(crate) fn lean(&mut self, expected: Expected, normal: [f64; 3], axes: [[f64; 3]; 2]) {
        let half = 0.5 * expected.weight;
        for (gradient, axis) in self.gradient.iter_mut().zip(axes) {
            *gradient -= half * dot(expected.normal, axis);
        }
        let bend = half * dot(expected.normal, normal).max(0.1);
        self.bend[0] += bend;
        self.bend[2] += bend;
    }

    /// The step to the least cost, were it a parabola.
    pub(crate) fn step(&self, damping: f64) -> [f64; 2] {
        let [uu, uv, vv] = self.bend;
        let more = damping * (uu + vv) + 1e-12;
        let (uu, vv) = (uu + more, vv + more);
        let determinant = uu * vv - uv * uv;
        let [a, b] = self.gradient;
        let step = [
            (uv * b - vv * a) / determinant,
            (uv * a - uu * b) / determinant,
        ];
        let length = step[0].hypot(step[1]);
        if length > PARAMETERS.longest_step {
            step.map(|value| value * PARAMETERS.longest_step / length)
        } else {
            step
        }
    }
}
