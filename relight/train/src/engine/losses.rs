//! Losses between maps, on tensors: how far albedo, shading and normals are from the ground truth.
//!
//! Pictures are `batch x channels x height x width`, weights `batch x 1 x height x width`, 0 outside
//! the mask. Every loss is the mean over the batch.

use tch::Tensor;

use super::tensors::over_channels;

/// Keeps a division by nothing from being one.
const TINY: f64 = 1e-6;
/// A chord so short counts as its square, for a gradient where it is 0.
const CHORD_FLOOR: f64 = 0.02;

/// A mean with its weight, so that means over parts of a batch can be combined.
#[derive(Debug)]
pub(crate) struct Mean {
    /// The mean.
    pub value: Tensor,
    /// Its weight, one number without gradient; above 0 if there is a mean.
    pub over: Tensor,
}

impl Mean {
    /// A sum over so much.
    pub(crate) fn new(sum: Tensor, over: Tensor) -> Self {
        let value = sum / &over;
        Self { value, over }
    }
}

/// Error that a factor of each picture cannot mend, as a part of the ground truth's energy: 0 for a multiple
/// of the ground truth, 1 for nothing of it. (The scale-invariant error of Grosse et al. 2009, relative.)
pub(crate) fn scale_invariant(found: &Tensor, truth: &Tensor, weight: &Tensor) -> Tensor {
    let sum = |a: &Tensor, b: &Tensor| {
        (a * b * weight)
            .flatten(1, -1)
            .sum_dim_intlist([1_i64].as_slice(), false, None)
    };
    let factor = sum(truth, found) / (sum(found, found) + TINY);
    let scaled = found * factor.view([-1, 1, 1, 1]);
    let rest = truth - &scaled;
    let part = sum(&rest, &rest) / (sum(truth, truth) + TINY);
    part.mean(None)
}

/// The same in windows of `side` pixels at half their side, each with a factor of its own; energies
/// are added up before they are divided. (The local error of Grosse et al. 2009, made
/// differentiable.) One channel.
pub(crate) fn windowed(found: &Tensor, truth: &Tensor, weight: &Tensor, side: i64) -> Tensor {
    let step = (side / 2).max(1);
    let pool = |a: &Tensor, b: &Tensor| {
        (a * b * weight).avg_pool2d([side; 2], [step; 2], [0; 2], false, true, None)
    };
    let (tt, tf, ff) = (pool(truth, truth), pool(truth, found), pool(found, found));
    let mean = ff.mean_dim([1_i64, 2, 3].as_slice(), true, None);
    // A window in which nothing is found has no factor.
    let floor = &mean * 1e-5 + 1e-8;
    let explained = tf.square() / (&ff + &floor);
    let over = [1_i64, 2, 3];
    let rest = (&tt - &explained).clamp_min(0.0);
    let rest = rest.sum_dim_intlist(over.as_slice(), false, None);
    let all = tt.sum_dim_intlist(over.as_slice(), false, None);
    (&rest / (&all + TINY)).mean(None)
}

/// Mean differences of the steps from pixel to pixel, down and across, for logarithms of pictures: what sharpens
/// edges and leaves flat parts flat. Their sum is the loss.
pub(crate) fn gradient(found: &Tensor, truth: &Tensor, weight: &Tensor) -> [Mean; 2] {
    let along = |dimension: i64| {
        let step = |of: &Tensor| {
            let length = of.size()[dimension as usize] - 1;
            (
                of.narrow(dimension, 1, length),
                of.narrow(dimension, 0, length),
            )
        };
        let (found, truth, weight) = (step(found), step(truth), step(weight));
        let both = &weight.0 * &weight.1;
        let error = &found.0 - &found.1 - (&truth.0 - &truth.1);
        let channels = error.size()[1] as f64;
        let sum = (error.abs() * &both).sum(None);
        let over = both.sum(None) * channels + TINY;
        Mean::new(sum, over)
    };
    [along(2), along(3)]
}

/// `1 - cos` of the angle between unit normals, mean under the weight.
pub(crate) fn angular(found: &Tensor, truth: &Tensor, weight: &Tensor) -> Mean {
    let cosine = over_channels(&(found * truth));
    let error = (-&cosine + 1.0) * weight;
    let over = weight.sum(None) + TINY;
    Mean::new(error.sum(None), over)
}

/// Length of the chord between unit normals, `2 sin(angle / 2)`, mean under the weight. It grows as the angle does and not
/// as its square: where two surfaces are possible, the likelier one costs least, and not the flat mean of both.
pub(crate) fn chord(found: &Tensor, truth: &Tensor, weight: &Tensor) -> Mean {
    let length = (over_channels(&(found - truth).square()) + (CHORD_FLOOR * CHORD_FLOOR)).sqrt()
        - CHORD_FLOOR;
    let over = weight.sum(None) + TINY;
    Mean::new((&length * weight).sum(None), over)
}

/// Distance of vectors (`batch x numbers`) from the true ones in parts of their length, mean over the batch without those of
/// which the truth is 0: it is not known.
pub(crate) fn relative_distance(found: &Tensor, truth: &Tensor) -> Mean {
    let length =
        |of: &Tensor| (of.square().sum_dim_intlist([1_i64].as_slice(), false, None) + TINY).sqrt();
    let of_truth = length(truth);
    let known = of_truth.gt(2.0 * TINY.sqrt()).to_kind(truth.kind());
    let part = length(&(found - truth)) / &of_truth * &known;
    // Of few numbers: anything added to them would show where a batch is divided.
    let over = known.sum(None).clamp_min(TINY);
    Mean::new(part.sum(None), over)
}

/// Mean angle between unit normals under the weight, degrees.
pub(crate) fn angular_degrees(found: &Tensor, truth: &Tensor, weight: &Tensor) -> Tensor {
    let cosine = over_channels(&(found * truth)).clamp(-1.0, 1.0);
    let angle = cosine.acos().rad2deg() * weight;
    let weights = weight.sum(None) + TINY;
    angle.sum(None) / &weights
}

#[cfg(test)]
mod tests {
    use tch::{Device, Kind};

    use super::*;

    /// One picture of a row of normals that are tilted to the right by so many degrees.
    fn tilted(degrees: &[f64]) -> Tensor {
        let rows = |value: fn(f64) -> f64| degrees.iter().map(move |d| value(d.to_radians()));
        let values: Vec<f64> = rows(f64::sin)
            .chain(rows(|_| 0.0))
            .chain(rows(f64::cos))
            .collect();
        Tensor::from_slice(&values).view([1, 3, 1, degrees.len() as i64])
    }

    fn even(pixels: i64) -> Tensor {
        Tensor::ones([1, 1, 1, pixels], (Kind::Double, Device::Cpu))
    }

    #[test]
    fn the_likelier_of_two_surfaces_costs_less_than_their_flat_mean() {
        let truth = tilted(&[40.0, 40.0, -40.0]);
        let cost = |loss: fn(&Tensor, &Tensor, &Tensor) -> Mean, tilt: f64| {
            let found = tilted(&[tilt; 3]);
            loss(&found, &truth, &even(3)).value.double_value(&[])
        };
        assert!(cost(chord, 40.0) < cost(chord, 15.0));
        assert!(cost(angular, 40.0) > cost(angular, 15.0));
    }

    #[test]
    fn lights_that_are_not_known_do_not_count() {
        let lights = |first: [f64; 9]| Tensor::from_slice2(&[first, [0.0; 9]]);
        let truth = lights([2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        let found = Tensor::from_slice2(&[
            [2.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
            [7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0, 7.0],
        ]);
        let distance = relative_distance(&found, &truth);
        assert!((distance.value.double_value(&[]) - 1.0 / 5.0_f64.sqrt()).abs() < 1e-3);
        assert!((distance.over.double_value(&[]) - 1.0).abs() < 1e-5);
    }

    #[test]
    fn a_chord_is_as_long_as_the_angle_says_and_has_a_gradient_where_it_is_none() {
        let (found, truth) = (tilted(&[30.0]), tilted(&[-30.0]));
        let length = chord(&found, &truth, &even(1)).value;
        assert!((length.double_value(&[]) - 1.0).abs() < CHORD_FLOOR);
        let exact = truth.set_requires_grad(true);
        let none = chord(&exact, &tilted(&[-30.0]), &even(1)).value;
        none.backward();
        assert!(none.double_value(&[]).abs() < 1e-12);
        assert_eq!(exact.grad().abs().max().double_value(&[]), 0.0);
    }
}
