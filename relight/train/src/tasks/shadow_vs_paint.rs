//! The part of a picture's darkness that is paint rather than lack of light: the target of the head for paint.
//!
//! A pixel of albedo R under a shading S is darker than the object's brightest place by `ln(R_b / R) + ln(S_b / S)`. The
//! first summand's part of the sum is what is paint. Bright pixels carry no information, so each is weighted by its darkness.

use tch::Tensor;

use crate::engine::losses::Mean;
use crate::engine::tensors::grey;

/// Keeps logarithms of dark values finite.
const FLOOR: f64 = 0.02;
/// Pixels along a side over which the brightest place is a mean.
const AROUND: i64 = 5;
/// Darkness beyond this counts no more: a factor of e^2.
const MAX_DARKNESS: f64 = 2.0;

/// Which part of a batch's darkness is paint and which is shadow, `batch x 1 x height x width`.
#[derive(Debug)]
pub(crate) struct ShadowVsPaint {
    /// Which part of it is paint, 0..=1.
    pub(crate) paint: Tensor,
    /// How dark a pixel is: by how much it counts, 0 outside the mask.
    pub(crate) weight: Tensor,
}

impl ShadowVsPaint {
    /// That of albedo under a shading.
    pub(crate) fn new(albedo: &Tensor, shading: &Tensor, mask: &Tensor) -> Self {
        let grey = grey(albedo);
        let (paint, shadow) = (darkness(&grey, mask), darkness(shading, mask));
        let sum = &paint + &shadow;
        Self {
            paint: &paint / (&sum + 1e-4),
            weight: sum.clamp_max(MAX_DARKNESS) * mask,
        }
    }

    /// The cross entropy of a prediction, a logit.
    pub(crate) fn cross_entropy(&self, logit: &Tensor) -> Mean {
        // softplus(x) - p x is the cross entropy of the probability p and the logit x.
        let entropy = logit.softplus() - &self.paint * logit;
        let over = self.weight.sum(None).clamp_min(1.0);
        Mean::new((&entropy * &self.weight).sum(None), over)
    }
}

/// By how much values are darker than the brightest place, as a logarithm, 0 and above.
fn darkness(of: &Tensor, mask: &Tensor) -> Tensor {
    let inside = of * mask;
    let half = AROUND / 2;
    let around = inside.avg_pool2d([AROUND; 2], [1; 2], [half; 2], false, true, None);
    let brightest = around.amax([1_i64, 2, 3], true);
    let log = |of: &Tensor| (of + FLOOR).log();
    (log(&brightest) - log(of)).clamp_min(0.0)
}

#[cfg(test)]
mod tests {
    use tch::{Device, Kind};

    use super::*;

    fn halves(left: f64, right: f64, channels: i64) -> Tensor {
        let side =
            |value: f64| Tensor::full([1, channels, 8, 8], value, (Kind::Double, Device::Cpu));
        Tensor::cat(&[side(left), side(right)], 3)
    }

    fn at(of: &Tensor, x: i64) -> f64 {
        of.double_value(&[0, 0, 4, x])
    }

    #[test]
    fn black_print_in_even_light_is_paint_and_a_shadow_on_even_paint_is_not() {
        let mask = halves(1.0, 1.0, 1);
        let print = ShadowVsPaint::new(&halves(0.8, 0.05, 3), &halves(1.0, 1.0, 1), &mask);
        assert!(at(&print.paint, 13) > 0.99 && at(&print.weight, 13) > 1.0);
        assert!(at(&print.weight, 3) < 0.01);
        let shadow = ShadowVsPaint::new(&halves(0.8, 0.8, 3), &halves(1.5, 0.1, 1), &mask);
        assert!(at(&shadow.paint, 13) < 0.01 && at(&shadow.weight, 13) > 1.0);
        let both = ShadowVsPaint::new(&halves(0.8, 0.2, 3), &halves(1.6, 0.4, 1), &mask);
        assert!((at(&both.paint, 13) - 0.5).abs() < 0.05);
    }

    #[test]
    fn the_right_answer_costs_least_and_what_is_outside_costs_nothing() {
        let mask = halves(1.0, 0.0, 1);
        let albedo = Tensor::cat(&[halves(0.8, 0.05, 3), halves(0.05, 0.8, 3)], 2);
        let (shading, mask) = (
            Tensor::ones_like(&albedo).narrow(1, 0, 1),
            mask.repeat([1, 1, 2, 1]),
        );
        let truth = ShadowVsPaint::new(&albedo, &shading, &mask);
        let cost = |left: f64, right: f64| {
            let logit = halves(left, right, 1).repeat([1, 1, 2, 1]);
            truth.cross_entropy(&logit).value.double_value(&[])
        };
        assert!(cost(5.0, 0.0) < 0.02 && cost(-5.0, 0.0) > 3.0);
        assert_eq!(cost(5.0, 0.0), cost(5.0, -9.0));
    }
}
