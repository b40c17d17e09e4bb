//! Random numbers that depend on a seed and on nothing else: not on threads, not on the order in
//! which samples are made. Knows nothing of what is drawn with them.

use std::f32::consts::TAU;
use std::ops::Range;

use glam::{Mat3, Quat, Vec3};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

/// The seed of the stream `number` below `seed`: streams of different numbers are unrelated.
///
/// ```
/// use relight_synth::stream;
/// assert_eq!(stream(1, 2), stream(1, 2));
/// assert_ne!(stream(1, 2), stream(2, 1));
/// ```
pub fn stream(seed: u64, number: u64) -> u64 {
    mix(mix(seed).wrapping_add(number.wrapping_mul(0x9e37_79b9_7f4a_7c15)))
}

/// The finaliser of SplitMix64: every bit of the result depends on every bit of `value`.
pub(super) fn mix(value: u64) -> u64 {
    let mut z = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number for a hash, nearly normally distributed, mean 0, standard deviation 1: the sum of four even numbers.
///
/// ```
/// use relight_synth::{normal_of, stream};
/// let squares = (0..1000).map(|number| normal_of(stream(7, number)).powi(2));
/// assert!((squares.sum::<f32>() / 1000.0 - 1.0).abs() < 0.1);
/// ```
pub fn normal_of(hash: u64) -> f32 {
    let parts = [0, 16, 32, 48].map(|shift| (hash >> shift & 0xffff) as f32 / 65_535.0);
    // Each has the variance 1 / 12.
    (parts.iter().sum::<f32>() - 2.0) * 3.0_f32.sqrt()
}

/// The upper 24 bits of a hash as a number in 0..1, 1 left out.
pub(super) fn unit_of(hash: u64) -> f32 {
    (hash >> 40) as f32 / (1_u64 << 24) as f32
}

/// A source of random numbers.
pub(super) struct Random(Pcg64Mcg);

impl Random {
    /// The source of a seed.
    pub(super) fn new(seed: u64) -> Self {
        Self(Pcg64Mcg::seed_from_u64(seed))
    }

    /// A seed for an independent stream of draws.
    pub(super) fn seed(&mut self) -> u64 {
        self.0.next_u64()
    }

    /// Uniform in 0..1, 1 left out.
    pub(super) fn unit(&mut self) -> f32 {
        unit_of(self.0.next_u64())
    }

    /// Uniform in the range.
    pub(super) fn uniform(&mut self, range: Range<f32>) -> f32 {
        range.start + (range.end - range.start) * self.unit()
    }

    /// Uniform in the logarithm; both ends are positive.
    pub(super) fn log_uniform(&mut self, range: Range<f32>) -> f32 {
        self.uniform(range.start.ln()..range.end.ln()).exp()
    }

    /// Normally distributed, mean 0, standard deviation 1 (Box and Muller).
    pub(super) fn normal(&mut self) -> f32 {
        let radius = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        radius * (TAU * self.unit()).cos()
    }

    /// True with this probability.
    pub(super) fn chance(&mut self, probability: f32) -> bool {
        self.unit() < probability
    }

    /// Uniform in 0..count; 0 where `count` is 0.
    pub(super) fn index(&mut self, count: usize) -> usize {
        let product = u128::from(self.0.next_u64()) * count as u128;
        (product >> 64) as usize
    }

    /// Uniform in the range of whole numbers.
    pub(super) fn count(&mut self, range: Range<usize>) -> usize {
        range.start + self.index(range.end.saturating_sub(range.start))
    }

    /// One of the choices, each with its own weight; the weights need not add up to 1.
    pub(super) fn weighted<T: Copy, const N: usize>(&mut self, choices: [(T, f32); N]) -> T {
        const { assert!(N > 0) };
        let total: f32 = choices.iter().map(|(_, weight)| weight).sum();
        let mut left = self.unit() * total;
        for (choice, weight) in choices {
            if left < weight {
                return choice;
            }
            left -= weight;
        }
        choices[N - 1].0
    }

    /// One of the choices, all alike.
    pub(super) fn pick<T: Copy, const N: usize>(&mut self, choices: [T; N]) -> T {
        const { assert!(N > 0) };
        choices[self.index(N)]
    }

    /// Uniform on the unit sphere.
    pub(super) fn direction(&mut self) -> Vec3 {
        let z = self.uniform(-1.0..1.0);
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        let radius = (1.0 - z * z).max(0.0).sqrt();
        Vec3::new(radius * cos, radius * sin, z)
    }

    /// Uniform in the box from `-half` to `half`.
    pub(super) fn in_box(&mut self, half: f32) -> Vec3 {
        let mut side = || self.uniform(-half..half);
        Vec3::new(side(), side(), side())
    }

    /// Uniform among all rotations.
    pub(super) fn rotation(&mut self) -> Mat3 {
        let [x, y, z, w] = std::array::from_fn(|_| self.normal());
        let length = (x * x + y * y + z * z + w * w).sqrt().max(1e-12);
        Mat3::from_quat(Quat::from_xyzw(
            x / length,
            y / length,
            z / length,
            w / length,
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_seed_gives_the_same_numbers_and_another_seed_others() {
        let numbers = |seed| {
            let mut random = Random::new(seed);
            std::array::from_fn::<u64, 4, _>(|_| random.seed())
        };
        assert_eq!(numbers(7), numbers(7));
        assert_ne!(numbers(7), numbers(8));
    }

    #[test]
    fn numbers_have_the_moments_of_their_distribution() {
        let mut random = Random::new(3);
        let n = 20_000;
        let moments = |draws: Vec<f32>| {
            let mean = draws.iter().sum::<f32>() / draws.len() as f32;
            let square = draws.iter().map(|x| (x - mean).powi(2)).sum::<f32>();
            (mean, square / draws.len() as f32)
        };
        let (mean, variance) = moments((0..n).map(|_| random.unit()).collect());
        assert!((mean - 0.5).abs() < 0.01 && (variance - 1.0 / 12.0).abs() < 0.002);
        let (mean, variance) = moments((0..n).map(|_| random.normal()).collect());
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05);
        let (mean, variance) = moments((0..n).map(|_| random.direction().x).collect());
        assert!(mean.abs() < 0.02 && (variance - 1.0 / 3.0).abs() < 0.01);
        let (mean, variance) = moments((0..n).map(|_| random.rotation().x_axis.z).collect());
        assert!(mean.abs() < 0.02 && (variance - 1.0 / 3.0).abs() < 0.01);
    }

    #[test]
    fn choices_come_as_often_as_their_weights_say() {
        let mut random = Random::new(5);
        let mut counts = [0; 3];
        for _ in 0..10_000 {
            counts[random.weighted([(0, 1.0), (1, 0.0), (2, 3.0)])] += 1;
        }
        assert_eq!(counts[1], 0);
        assert!((2200..2800).contains(&counts[0]), "{counts:?}");
        assert_eq!(random.index(0), 0);
    }
}
