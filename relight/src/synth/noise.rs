//! Smooth noise in space (Perlin's gradient noise) with its gradient. Knows nothing of what it is
//! used for.

use glam::Vec3;

use super::random::mix;

/// Noise with features about `1 / frequency` across, of mean 0, within about -1..1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    seed: u64,
    frequency: f32,
}

/// A value and its gradient by position.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sloped {
    pub(super) value: f32,
    pub(super) gradient: Vec3,
}

impl Noise {
    pub(super) fn new(seed: u64, frequency: f32) -> Self {
        Self { seed, frequency }
    }

    /// The noise at a point.
    pub(super) fn at(&self, point: Vec3) -> f32 {
        self.sloped(point).value
    }

    /// The noise and its gradient at a point.
    pub(super) fn sloped(&self, point: Vec3) -> Sloped {
        let scaled = point * self.frequency;
        let cell = scaled.floor();
        let inside = scaled - cell;
        let corner = [cell.x as i64, cell.y as i64, cell.z as i64];
        // Quintic blend: the gradient is continuous too.
        let blend = inside * inside * inside * (inside * (inside * 6.0 - 15.0) + 10.0);
        let slope = inside * inside * (inside * (inside * 30.0 - 60.0) + 30.0);
        let mut sum = Sloped::default();
        for k in 0..8_i64 {
            let offset = [k & 1, (k >> 1) & 1, k >> 2];
            let towards = Vec3::from_array(offset.map(|o| o as f32));
            let direction = self.direction([0, 1, 2].map(|i| corner[i] + offset[i]));
            let ramp = direction.dot(inside - towards);
            let weights = Vec3::ONE - towards + (towards * 2.0 - 1.0) * blend;
            let slopes = (towards * 2.0 - 1.0) * slope;
            let weight = weights.x * weights.y * weights.z;
            sum.value += weight * ramp;
            sum.gradient += direction * weight
                + ramp
                    * Vec3::new(
                        slopes.x * weights.y * weights.z,
                        weights.x * slopes.y * weights.z,
                        weights.x * weights.y * slopes.z,
                    );
        }
        sum.gradient *= self.frequency;
        sum
    }

    /// One of the twelve directions from a cube's centre to its edges, by a hash of the corner.
    fn direction(&self, [x, y, z]: [i64; 3]) -> Vec3 {
        let place = (x as u64).wrapping_mul(0x8da6_b343)
            ^ (y as u64).wrapping_mul(0xd816_3841_0000)
            ^ (z as u64).wrapping_mul(0xcb1a_b31f_0000_0001);
        let hash = mix(place ^ self.seed);
        let sign = |bit: u64| if hash & bit == 0 { 1.0 } else { -1.0 };
        let (a, b) = (sign(1), sign(2));
        match (hash >> 2) % 3 {
            0 => Vec3::new(a, b, 0.0),
            1 => Vec3::new(a, 0.0, b),
            _ => Vec3::new(0.0, a, b),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::random::Random;

    #[test]
    fn the_gradient_is_that_of_finite_differences() {
        let mut random = Random::new(1);
        let noise = Noise::new(9, 3.0);
        for _ in 0..200 {
            let point = random.in_box(2.0);
            let gradient = noise.sloped(point).gradient;
            for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
                let step = 1e-3;
                let ahead = noise.at(point + axis * step);
                let behind = noise.at(point - axis * step);
                let slope = (ahead - behind) / (2.0 * step);
                assert!(
                    (gradient.dot(axis) - slope).abs() < 2e-2,
                    "{gradient} {slope}"
                );
            }
        }
    }

    #[test]
    fn noise_is_smooth_centred_and_bounded() {
        let mut random = Random::new(2);
        let noise = Noise::new(4, 5.0);
        let values: Vec<f32> = (0..5000).map(|_| noise.at(random.in_box(3.0))).collect();
        let mean = values.iter().sum::<f32>() / values.len() as f32;
        assert!(mean.abs() < 0.02, "{mean}");
        assert!(values.iter().all(|v| v.abs() < 1.2));
        assert!(values.iter().any(|v| v.abs() > 0.4));
    }
}
