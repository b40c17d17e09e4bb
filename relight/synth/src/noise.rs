//! Smooth noise in space (Perlin, *Improving Noise*, 2002) with its gradient. Knows nothing of what it
//! is used for.

use glam::Vec3;

use super::random::mix;

/// Noise with features about `1 / frequency` across, of mean 0, within about -1..1.
#[derive(Debug, Clone, Copy)]
pub(super) struct Noise {
    seed: u32,
    frequency: f32,
}

/// A value and its gradient by position.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ValueGradient {
    pub(super) value: f32,
    pub(super) gradient: Vec3,
}

/// From a cube's centre to the middles of its edges; four of them twice.
const DIRECTIONS: [Vec3; 16] = [
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(-1.0, 1.0, 0.0),
    Vec3::new(1.0, -1.0, 0.0),
    Vec3::new(-1.0, -1.0, 0.0),
    Vec3::new(1.0, 0.0, 1.0),
    Vec3::new(-1.0, 0.0, 1.0),
    Vec3::new(1.0, 0.0, -1.0),
    Vec3::new(-1.0, 0.0, -1.0),
    Vec3::new(0.0, 1.0, 1.0),
    Vec3::new(0.0, -1.0, 1.0),
    Vec3::new(0.0, 1.0, -1.0),
    Vec3::new(0.0, -1.0, -1.0),
    Vec3::new(1.0, 1.0, 0.0),
    Vec3::new(-1.0, 1.0, 0.0),
    Vec3::new(0.0, -1.0, 1.0),
    Vec3::new(0.0, -1.0, -1.0),
];

impl Noise {
    pub(super) fn new(seed: u64, frequency: f32) -> Self {
        Self {
            seed: (mix(seed) >> 32) as u32,
            frequency,
        }
    }

    /// The noise at a point.
    pub(super) fn at(&self, point: Vec3) -> f32 {
        let Cell { inside, directions } = self.cell(point);
        let [a, b, c, d, e, f, g, h] = ramps(inside, &directions);
        let [u, v, w] = blend(inside).to_array();
        let lerp = |from: f32, to: f32, part: f32| from + (to - from) * part;
        let below = lerp(lerp(a, b, u), lerp(c, d, u), v);
        let above = lerp(lerp(e, f, u), lerp(g, h, u), v);
        lerp(below, above, w)
    }

    /// The noise and its gradient at a point.
    pub(super) fn sloped(&self, point: Vec3) -> ValueGradient {
        let Cell { inside, directions } = self.cell(point);
        let [a, b, c, d, e, f, g, h] = ramps(inside, &directions);
        let [u, v, w] = blend(inside).to_array();
        let slope = inside * inside * (inside * (inside * 30.0 - 60.0) + 30.0);
        let lerp = |from: f32, to: f32, part: f32| from + (to - from) * part;
        let mixed = |from: Vec3, to: Vec3, part: f32| from + (to - from) * part;
        let [da, db, dc, dd, de, df, dg, dh] = directions;
        let low = mixed(mixed(da, db, u), mixed(dc, dd, u), v);
        let high = mixed(mixed(de, df, u), mixed(dg, dh, u), v);
        // Along each axis: how the weights of the two sides change.
        let along = Vec3::new(
            lerp(lerp(b - a, d - c, v), lerp(f - e, h - g, v), w),
            lerp(lerp(c - a, d - b, u), lerp(g - e, h - f, u), w),
            lerp(lerp(e - a, f - b, u), lerp(g - c, h - d, u), v),
        );
        let below = lerp(lerp(a, b, u), lerp(c, d, u), v);
        let above = lerp(lerp(e, f, u), lerp(g, h, u), v);
        ValueGradient {
            value: lerp(below, above, w),
            gradient: (mixed(low, high, w) + along * slope) * self.frequency,
        }
    }

    /// The cell of the lattice in which a point lies.
    fn cell(&self, point: Vec3) -> Cell {
        let scaled = point * self.frequency;
        let [x, y, z] = scaled.to_array().map(floor);
        let steps = |at: i32, odd: u32| {
            let first = (at as u32).wrapping_mul(odd);
            [first, first.wrapping_add(odd)]
        };
        let (xs, ys, zs) = (
            steps(x, 0x8da6_b343),
            steps(y, 0xd816_3841),
            steps(z, 0xcb1a_b31f),
        );
        Cell {
            inside: scaled - Vec3::new(x as f32, y as f32, z as f32),
            directions: std::array::from_fn(|k| {
                let place = xs[k & 1] ^ ys[k >> 1 & 1] ^ zs[k >> 2] ^ self.seed;
                let mixed = (place ^ place >> 16).wrapping_mul(0x7feb_352d);
                DIRECTIONS[((mixed ^ mixed >> 15).wrapping_mul(0x846c_a68b) >> 28) as usize]
            }),
        }
    }
}

/// A cell of the lattice.
struct Cell {
    /// Where the point lies in it, 0..1.
    inside: Vec3,
    /// The directions at its corners: x changes first, then y, then z.
    directions: [Vec3; 8],
}

/// How far the point lies along each corner's direction from that corner.
fn ramps(inside: Vec3, directions: &[Vec3; 8]) -> [f32; 8] {
    std::array::from_fn(|k| {
        let corner = Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32);
        directions[k].dot(inside - corner)
    })
}

/// Quintic: the gradient is continuous too.
fn blend(inside: Vec3) -> Vec3 {
    inside * inside * inside * (inside * (inside * 6.0 - 15.0) + 10.0)
}

/// The largest whole number that is not above `value`; a function call on older processors otherwise.
fn floor(value: f32) -> i32 {
    let towards_zero = value as i32;
    towards_zero - i32::from(value < towards_zero as f32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

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
