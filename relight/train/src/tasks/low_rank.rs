//! The low-rank loss: how far N pictures of one reflectance are from being multiples of one picture.
//!
//! The rows of R (N x d) are the reflectances of one object under N lights. They belong to one object
//! when R has rank one. The paper's loss is the squared Frobenius distance to the best approximation
//! of rank one, `||R - Rbar||^2` with `Rbar = v v^T R`, v the first left singular vector, and Rbar
//! taken as a constant. (Section on the low-rank loss; theorem 2: gradient descent with a rate
//! between 0 and 0.5 then converges to Rbar.)
//!
//! v is the first eigenvector of the N x N Gram matrix R R^T: squaring that matrix again and again
//! leaves nothing else of it, and no decomposition of d columns is needed.

use crate::engine::tensors::over_channels;
use tch::Tensor;

/// How often the Gram matrix is squared: the second eigenvalue counts as its ratio to the first, to
/// the power 256.
const SQUARINGS: usize = 8;
/// Keeps a division by nothing from being one.
const TINY: f64 = 1e-20;

/// The first left singular vector of each matrix of `groups x N x d`: `groups x N x 1`, without
/// gradient.
pub(crate) fn first_singular_vector(rows: &Tensor) -> Tensor {
    let rows = rows.detach();
    let mut power = rows.matmul(&rows.transpose(1, 2));
    for squared in 0..=SQUARINGS {
        let diagonal = power.diagonal(0, 1, 2);
        let trace = over_channels(&diagonal);
        let trace = trace.clamp_min(TINY).unsqueeze(2);
        power = &power / &trace;
        if squared < SQUARINGS {
            power = power.matmul(&power);
        }
    }
    // Every column is a multiple of the vector; the longest is the most exact.
    let longest = power.diagonal(0, 1, 2).argmax(1, false);
    let size = power.size();
    let index = longest
        .view([size[0], 1, 1])
        .expand([size[0], size[1], 1], false);
    let column = power.gather(2, &index, false);
    let square = over_channels(&column.square());
    &column / square.clamp_min(TINY).sqrt()
}

/// The best approximation of rank one of each matrix of `groups x N x d`, without gradient.
pub(crate) fn rank_one(rows: &Tensor) -> Tensor {
    let vector = first_singular_vector(rows);
    let shares = vector.transpose(1, 2).matmul(&rows.detach());
    vector.matmul(&shares)
}

/// The loss of each group of `groups x N x d` rows, averaged over the groups.
pub(crate) fn low_rank_loss(rows: &Tensor) -> Tensor {
    let square =
        (rows - rank_one(rows))
            .square()
            .sum_dim_intlist([1_i64, 2].as_slice(), false, None);
    square.mean(None)
}

/// Chromaticity (r, g) / (r + g + b) of diffuse pictures, `batch x 3 x height x width` to
/// `batch x 2 x height x width`: what Spec-Net's low-rank loss looks at, since highlights are whiter
/// than the object.
pub(crate) fn chromaticity(diffuse: &Tensor) -> Tensor {
    let sum = over_channels(diffuse);
    diffuse.narrow(1, 0, 2) / sum.clamp_min(1e-5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;

    fn random(shape: &[i64]) -> Tensor {
        tch::manual_seed(3);
        Tensor::randn(shape, (tch::Kind::Double, tch::Device::Cpu))
    }

    fn loss(rows: &Tensor) -> f64 {
        low_rank_loss(rows).double_value(&[])
    }

    #[test]
    fn rows_that_are_multiples_of_one_cost_nothing() {
        let rows = random(&[2, 12, 1]).matmul(&random(&[2, 1, 300]));
        assert!(loss(&rows) < 1e-18);
    }

    #[test]
    fn the_rest_is_the_sum_of_the_other_singular_values_squared() {
        let rows = random(&[1, 12, 300]) + random(&[1, 12, 1]).matmul(&random(&[1, 1, 300])) * 4.0;
        let (_, values, _) = rows.svd(true, true);
        let others = values.narrow(1, 1, 11).square().sum(None).double_value(&[]);
        assert!((loss(&rows) / others - 1.0).abs() < 1e-9);
    }

    #[test]
    fn gradient_descent_below_one_half_reaches_the_approximation_and_above_one_it_does_not() {
        let start = random(&[1, 6, 40]) * 0.3 + random(&[1, 6, 1]).matmul(&random(&[1, 1, 40]));
        let goal = rank_one(&start);
        let descend = |rate: f64| {
            let mut rows = start.copy();
            for _ in 0..200 {
                let leaf = rows.detach().set_requires_grad(true);
                low_rank_loss(&leaf).backward();
                rows = tch::no_grad(|| &leaf - leaf.grad() * rate);
            }
            (&rows - &goal).square().sum(None).double_value(&[])
        };
        for rate in [0.05, 0.25, 0.49] {
            assert!(descend(rate) < 1e-12, "rate {rate}");
        }
        let far = descend(1.05);
        assert!(far.is_nan() || far > 1.0, "{far}");
    }

    proptest! {
        /// Theorem 1: no `b c^T` is nearer to R. For a given b, the best c is `R^T b / |b|^2`.
        #[test]
        fn no_other_matrix_of_rank_one_is_nearer(
            entries in vec(-2.0..2.0_f64, 5 * 9),
            direction in vec(-1.0..1.0_f64, 5),
            toward in 0.0..1.0_f64,
        ) {
            let rows = Tensor::from_slice(&entries).view([1, 5, 9]);
            let best = first_singular_vector(&rows);
            // Any direction, and directions close to the best one.
            let b = Tensor::from_slice(&direction).view([1, 5, 1]) * (1.0 - toward) + best * toward;
            let square = b.square().sum(None).double_value(&[]);
            prop_assume!(square > 1e-6);
            let c = b.transpose(1, 2).matmul(&rows) / square;
            let distance = (&rows - b.matmul(&c)).square().sum(None).double_value(&[]);
            // Of two equal singular values, either vector is right; 256th powers leave a little of the second.
            prop_assert!(loss(&rows) <= distance * (1.0 + 1e-4), "{} {distance}", loss(&rows));
        }

        /// What a light does to a row, making it brighter or darker, is neither a gain nor a loss where the
        /// rows belong together: the rest of rank-one rows that were scaled, and then disturbed, is at most the disturbance.
        #[test]
        fn scaled_rows_with_a_disturbance_cost_at_most_the_disturbance(
            factors in vec(0.1..3.0_f64, 6),
            disturbance in vec(-0.1..0.1_f64, 6 * 9),
        ) {
            let rows = Tensor::from_slice(&factors).view([1, 6, 1]).matmul(&random(&[1, 1, 9]));
            let disturbance = Tensor::from_slice(&disturbance).view([1, 6, 9]);
            let most = disturbance.square().sum(None).double_value(&[]);
            prop_assert!(loss(&(rows + disturbance)) <= most * (1.0 + 1e-4));
        }
    }

    #[test]
    fn a_row_that_is_scaled_keeps_rank_one() {
        let rows = random(&[1, 5, 60]);
        let approximation = rank_one(&rows);
        let factors = Tensor::from_slice(&[1.0, 2.0, 0.5, 3.0, 0.1]).view([1, 5, 1]);
        assert!(loss(&(approximation * factors)) < 1e-18);
    }

    #[test]
    fn its_gradient_is_twice_the_rest() {
        let rows = random(&[1, 4, 30]).set_requires_grad(true);
        low_rank_loss(&rows).backward();
        let wanted = (rows.detach() - rank_one(&rows)) * 2.0;
        let worst = (rows.grad() - wanted).abs().max().double_value(&[]);
        assert!(worst < 1e-4, "{worst}");
    }
}
