//! Gaussian mixtures: how likely a feature is on one side of the cut.
//!
//! As in GrabCut (Rother, Kolmogorov, Blake, 2004): each sample belongs to one component only, and the first
//! components come from splitting the samples along their principal axes (Orchard and Bouman, 1991),
//! which needs no random numbers.

use super::grab_cut::squared_distance;

/// Rounds of moving the split components' centres to their samples.
const LLOYD_ROUNDS: usize = 4;
/// Rounds of the power method, enough for a direction to split along.
const POWER_ROUNDS: usize = 12;

/// A mixture of Gaussians in `D` dimensions.
#[derive(Debug, Clone)]
pub(crate) struct GaussianMixture<const D: usize> {
    components: Vec<Gaussian<D>>,
    /// Added to the variances: the spread of equal surfaces.
    floor: f64,
}

#[derive(Debug, Clone)]
struct Gaussian<const D: usize> {
    /// Logarithm of the weight over the root of the covariance's determinant.
    log_scale: f32,
    mean: [f32; D],
    /// The inverse of the covariance's lower Cholesky factor.
    whitening: [[f32; D]; D],
}

/// Sums over the samples of one component.
#[derive(Debug, Clone)]
struct Moments<const D: usize> {
    count: f64,
    sum: [f64; D],
    square: [[f64; D]; D],
}

impl<const D: usize> GaussianMixture<D> {
    /// Learns `count` components, or fewer if the samples have fewer values.
    pub(crate) fn learn(samples: &[[f32; D]], count: usize, floor: f64) -> Self {
        let centres = split(samples, count);
        let nearest = |sample: &[f32; D]| nearest(&centres, sample);
        Self::from_assignment(samples, centres.len(), floor, nearest)
    }

    /// Learns again: each sample belongs to the component under which it is most likely.
    pub(crate) fn refine(&mut self, samples: &[[f32; D]]) {
        let best = |sample: &[f32; D]| self.best(sample);
        let refined = Self::from_assignment(samples, self.components.len(), self.floor, best);
        if !refined.components.is_empty() {
            *self = refined;
        }
    }

    /// The negative logarithm of the likelihood, without the constant that all mixtures share.
    pub(crate) fn cost(&self, sample: &[f32; D]) -> f32 {
        let logs = || self.components.iter().map(|gaussian| gaussian.log(sample));
        let most = logs().fold(f32::NEG_INFINITY, f32::max);
        if most == f32::NEG_INFINITY {
            return 0.0;
        }
        let rest: f32 = logs().map(|log| (log - most).exp()).sum();
        -(most + rest.ln())
    }

    fn best(&self, sample: &[f32; D]) -> usize {
        let logs = self.components.iter().map(|gaussian| gaussian.log(sample));
        let best = logs.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or(0, |(at, _)| at)
    }

    fn from_assignment(
        samples: &[[f32; D]],
        count: usize,
        floor: f64,
        component: impl Fn(&[f32; D]) -> usize,
    ) -> Self {
        let mut moments = vec![Moments::default(); count];
        for sample in samples {
            moments[component(sample)].add(sample);
        }
        let all = samples.len() as f64;
        let components = moments.iter().filter(|moments| moments.count > 0.0);
        Self {
            components: components
                .map(|moments| moments.gaussian(all, floor))
                .collect(),
            floor,
        }
    }
}

impl<const D: usize> Gaussian<D> {
    fn log(&self, sample: &[f32; D]) -> f32 {
        let mut distance = 0.0;
        for row in 0..D {
            let offsets = sample
                .iter()
                .zip(&self.mean)
                .map(|(value, mean)| value - mean);
            let terms = offsets.zip(&self.whitening[row]).take(row + 1);
            let sum: f32 = terms.map(|(offset, weight)| weight * offset).sum();
            distance += sum * sum;
        }
        self.log_scale - 0.5 * distance
    }
}

impl<const D: usize> Default for Moments<D> {
    fn default() -> Self {
        Self {
            count: 0.0,
            sum: [0.0; D],
            square: [[0.0; D]; D],
        }
    }
}

impl<const D: usize> Moments<D> {
    fn from_samples<'a>(samples: impl Iterator<Item = &'a [f32; D]>) -> Self {
        let mut moments = Self::default();
        samples.for_each(|sample| moments.add(sample));
        moments
    }

    fn add(&mut self, sample: &[f32; D]) {
        let sample = sample.map(f64::from);
        self.count += 1.0;
        for row in 0..D {
            self.sum[row] += sample[row];
            for column in 0..=row {
                self.square[row][column] += sample[row] * sample[column];
            }
        }
    }

    fn mean(&self) -> [f64; D] {
        self.sum.map(|sum| sum / self.count.max(1.0))
    }

    /// The covariance; only its lower triangle is filled.
    fn covariance(&self, floor: f64) -> [[f64; D]; D] {
        let mean = self.mean();
        std::array::from_fn(|row| {
            std::array::from_fn(|column| {
                if column > row {
                    return 0.0;
                }
                let spread = self.square[row][column] / self.count.max(1.0);
                let diagonal = if row == column { floor } else { 0.0 };
                spread - mean[row] * mean[column] + diagonal
            })
        })
    }

    fn gaussian(&self, all: f64, floor: f64) -> Gaussian<D> {
        let lower = cholesky(&self.covariance(floor), floor);
        let log_determinant: f64 = (0..D).map(|at| 2.0 * lower[at][at].ln()).sum();
        let log_scale = (self.count / all).ln() - 0.5 * log_determinant;
        Gaussian {
            log_scale: log_scale as f32,
            mean: self.mean().map(|value| value as f32),
            whitening: inverse(&lower).map(|row| row.map(|value| value as f32)),
        }
    }

    /// The direction of the largest spread, and the variance along it.
    fn principal_axis(&self) -> ([f64; D], f64) {
        let covariance = self.covariance(0.0);
        let mut axis = [1.0; D];
        let mut variance = 0.0;
        for _ in 0..POWER_ROUNDS {
            let mut next = [0.0; D];
            for row in 0..D {
                for column in 0..D {
                    let entry = covariance[row.max(column)][row.min(column)];
                    next[row] += entry * axis[column];
                }
            }
            variance = next.iter().map(|value| value * value).sum::<f64>().sqrt();
            if variance <= 0.0 {
                return (axis, 0.0);
            }
            axis = next.map(|value| value / variance);
        }
        (axis, variance)
    }
}

/// The lower factor of a covariance; `floor` is put where rounding made it indefinite.
fn cholesky<const D: usize>(covariance: &[[f64; D]; D], floor: f64) -> [[f64; D]; D] {
    let mut lower = [[0.0; D]; D];
    for row in 0..D {
        for column in 0..=row {
            let known: f64 = (0..column).map(|k| lower[row][k] * lower[column][k]).sum();
            let rest = covariance[row][column] - known;
            lower[row][column] = if row == column {
                rest.max(floor).sqrt()
            } else {
                rest / lower[column][column]
            };
        }
    }
    lower
}

/// The inverse of a lower triangular matrix.
fn inverse<const D: usize>(lower: &[[f64; D]; D]) -> [[f64; D]; D] {
    let mut inverse = [[0.0; D]; D];
    for column in 0..D {
        inverse[column][column] = 1.0 / lower[column][column];
        for row in column + 1..D {
            let sum: f64 = (column..row)
                .map(|k| lower[row][k] * inverse[k][column])
                .sum();
            inverse[row][column] = -sum / lower[row][row];
        }
    }
    inverse
}

/// The centres of `count` groups: the one with the largest spread is split until there are enough.
fn split<const D: usize>(samples: &[[f32; D]], count: usize) -> Vec<[f32; D]> {
    let mut group = vec![0_usize; samples.len()];
    let mut centres = vec![Moments::from_samples(samples.iter()).mean()];
    while centres.len() < count {
        let moments = moments_of_groups(samples, &group, centres.len());
        let axes: Vec<_> = moments.iter().map(Moments::principal_axis).collect();
        let widest = axes
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.1.total_cmp(&b.1.1));
        let Some((widest, &(axis, variance))) = widest else {
            break;
        };
        if variance <= 0.0 {
            break;
        }
        let mean = moments[widest].mean();
        let new = centres.len();
        for (sample, group) in samples.iter().zip(&mut group) {
            if *group == widest && along(sample, &mean, &axis) > 0.0 {
                *group = new;
            }
        }
        let moments = moments_of_groups(samples, &group, new + 1);
        centres = moments.iter().map(Moments::mean).collect();
    }
    let mut centres: Vec<[f32; D]> = centres
        .iter()
        .map(|c| c.map(|value| value as f32))
        .collect();
    for _ in 0..LLOYD_ROUNDS {
        for (sample, group) in samples.iter().zip(&mut group) {
            *group = nearest(&centres, sample);
        }
        let moments = moments_of_groups(samples, &group, centres.len());
        let filled = moments.iter().filter(|moments| moments.count > 0.0);
        centres = filled
            .map(|moments| moments.mean().map(|value| value as f32))
            .collect();
    }
    centres
}

fn moments_of_groups<const D: usize>(
    samples: &[[f32; D]],
    group: &[usize],
    count: usize,
) -> Vec<Moments<D>> {
    let mut moments = vec![Moments::default(); count];
    for (sample, &group) in samples.iter().zip(group) {
        moments[group].add(sample);
    }
    moments
}

fn along<const D: usize>(sample: &[f32; D], mean: &[f64; D], axis: &[f64; D]) -> f64 {
    (0..D)
        .map(|at| (f64::from(sample[at]) - mean[at]) * axis[at])
        .sum()
}

fn nearest<const D: usize>(centres: &[[f32; D]], sample: &[f32; D]) -> usize {
    let distance = |centre: &[f32; D]| squared_distance(centre, sample);
    let distances = centres.iter().map(distance).enumerate();
    let best = distances.min_by(|a, b| a.1.total_cmp(&b.1));
    best.map_or(0, |(at, _)| at)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two clusters, around (0, 0) and (10, 4), with some spread.
    fn clusters() -> Vec<[f32; 2]> {
        let spread = |at: usize| ((at * 7 % 11) as f32 / 11.0, (at * 5 % 13) as f32 / 13.0);
        let sample = |at: usize| {
            let (dx, dy) = spread(at);
            if at.is_multiple_of(2) {
                [dx, dy]
            } else {
                [10.0 + dx, 4.0 + dy]
            }
        };
        (0..400).map(sample).collect()
    }

    #[test]
    fn what_was_learned_costs_less_than_what_was_not() {
        let mut mixture = GaussianMixture::learn(&clusters(), 2, 0.01);
        mixture.refine(&clusters());
        for near in [[0.5, 0.5], [10.5, 4.5]] {
            assert!(mixture.cost(&near) < 1.0, "{}", mixture.cost(&near));
        }
        for far in [[5.0, 2.0], [10.5, 0.5], [-9.0, 9.0]] {
            assert!(mixture.cost(&far) > 10.0, "{}", mixture.cost(&far));
        }
    }

    #[test]
    fn equal_samples_make_one_component_of_the_floors_spread() {
        let mixture = GaussianMixture::learn(&[[3.0, 3.0]; 50], 5, 0.01);
        assert_eq!(mixture.components.len(), 1);
        // -ln of the peak of a Gaussian with the variance 0.01 in two dimensions, less the constant.
        assert!((mixture.cost(&[3.0, 3.0]) - 0.01_f32.ln()).abs() < 1e-3);
    }

    #[test]
    fn a_mixture_of_nothing_has_no_opinion() {
        let mixture = GaussianMixture::<3>::learn(&[], 5, 0.01);
        assert!(mixture.cost(&[1.0, 2.0, 3.0]).abs() < 1e-6);
    }
}
