//! Light for turns: rooms made of panoramas, lamps and even light.

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use relight_core::image::{Extent, Planes, Rgb};
use relight_core::light::{Direction, Panorama, Rotation, ShLight, basis};

use super::TRANSFER_ORDER;
use crate::random::{Random, stream};
use crate::vectors::rotation_rows;

/// Size at which panoramas are projected: many times finer than the order of the light.
const PROJECTED: Extent = Extent::new(96, 48);
/// Part of the rooms that mix two panoramas.
const MIXED: f32 = 0.3;
/// Part of the rooms with lamps beside.
const WITH_LAMPS: f32 = 0.4;
/// Part of the rooms with even light beside.
const WITH_EVEN: f32 = 0.2;
/// Part of the rooms that are nearly alike on two opposite sides.
const TWO_SIDED: f32 = 0.12;
/// Part of the rooms whose light hardly changes over the turn.
const NEARLY_EVEN: f32 = 0.08;
/// Deviation of the table's axis from a panorama's zenith, radians.
const TILT: f32 = 0.15;
/// Part of the rooms that are turned any way: floors that are brighter than ceilings, windows above.
const ANY_WAY: f32 = 0.15;

/// Light to draw from, in the table's frame.
#[derive(Debug, Clone)]
pub struct EnvironmentLights {
    /// Mean radiance 1; one list a panorama: as it is, and in other curves of brightness.
    panoramas: Vec<Vec<ShLight>>,
}

impl EnvironmentLights {
    /// Rooms of these panoramas, each in `variants` curves of brightness. Black panoramas are left out.
    pub fn new(panoramas: &[&Panorama], variants: u32, seed: u64) -> Self {
        let of = |(number, panorama): (usize, &&Panorama)| {
            let small = panorama.resized(PROJECTED);
            (0..variants.max(1))
                .filter_map(|variant| {
                    let seed = stream(stream(seed, number as u64), u64::from(variant));
                    let mut random = Random::new(seed);
                    let image = if variant == 0 {
                        small.clone()
                    } else {
                        recoloured(&small, &mut random)?
                    };
                    of_mean_one(&image.project(TRANSFER_ORDER))
                })
                .collect::<Vec<ShLight>>()
        };
        let panoramas = panoramas.par_iter().enumerate().map(of).collect::<Vec<_>>();
        Self {
            panoramas: panoramas
                .into_iter()
                .filter(|list| !list.is_empty())
                .collect(),
        }
    }

    /// The room of a seed, in the table's frame; even light without panoramas.
    pub fn draw(&self, seed: u64) -> ShLight {
        let mut random = Random::new(seed);
        let mut light = self.panorama(&mut random);
        if random.chance(MIXED) {
            let other = self.panorama(&mut random);
            let share = random.uniform(0.1..0.5);
            light.add(&other, [f64::from(share); 3]);
        }
        if random.chance(WITH_LAMPS) {
            for _ in 0..random.count(1..4) {
                add_lamp(&mut light, &mut random);
            }
        }
        if random.chance(WITH_EVEN) {
            let share = f64::from(random.log_uniform(0.1..1.5)) as f32;
            let even = ShLight::even(TRANSFER_ORDER, [1.0; 3]);
            light.add(&even, [f64::from(share); 3]);
        }
        if random.chance(TWO_SIDED) {
            let left = random.uniform(0.02..0.4);
            scale_orders(&mut light, |m| if m % 2 == 1 { left } else { 1.0 });
        }
        if random.chance(NEARLY_EVEN) {
            let left = random.uniform(0.1..0.5);
            scale_orders(&mut light, |m| if m > 0 { left } else { 1.0 });
        }
        light
    }

    fn panorama(&self, random: &mut Random) -> ShLight {
        let Some(variants) = self.panoramas.get(random.index(self.panoramas.len())) else {
            return ShLight::even(TRANSFER_ORDER, [1.0; 3]);
        };
        let mut light = variants[random.index(variants.len())].clone();
        if random.chance(0.5) {
            mirror(&mut light);
        }
        let about = Mat3::from_rotation_z(random.uniform(0.0..std::f32::consts::TAU));
        let lean = Mat3::from_rotation_x(random.normal() * TILT)
            * Mat3::from_rotation_y(random.normal() * TILT);
        if random.chance(ANY_WAY) {
            return light.rotated(&rotation(random.rotation()));
        }
        // A panorama's zenith is y up; that of the table is z.
        let upright = Mat3::from_rotation_x(std::f32::consts::FRAC_PI_2);
        light.rotated(&rotation(about * lean * upright))
    }
}

pub(super) fn rotation(matrix: Mat3) -> Rotation {
    // The rows are exact: this is a rotation.
    Rotation::from_matrix(rotation_rows(matrix)).unwrap_or(Rotation::IDENTITY)
}

/// A panorama in another curve of brightness, other colours, its brightest parts cut off.
fn recoloured(panorama: &Panorama, random: &mut Random) -> Option<Panorama> {
    let planes = panorama.image().planes();
    let values = planes.planes().into_iter().flatten();
    let (mut sum, mut largest) = (0.0_f64, 0.0_f32);
    for &value in values {
        sum += f64::from(value);
        largest = largest.max(value);
    }
    let mean = (sum / (3 * PROJECTED.pixels()) as f64) as f32;
    let gamma = random.uniform(0.7..1.15);
    let cut = if random.chance(0.4) {
        mean * random.log_uniform(3.0..100.0)
    } else {
        largest
    };
    let tint: [f32; 3] = std::array::from_fn(|_| (random.normal() * 0.12).exp());
    let swap = random.chance(0.2);
    let mut image = Planes::<3>::zeros(PROJECTED);
    for y in 0..PROJECTED.height {
        for x in 0..PROJECTED.width {
            let [r, g, b] = planes.pixel(x, y);
            let pixel = if swap { [b, g, r] } else { [r, g, b] };
            let curve = |value: f32| (value.clamp(0.0, cut) / mean.max(1e-12)).powf(gamma);
            image.set_pixel(x, y, [0, 1, 2].map(|c| curve(pixel[c]) * tint[c]));
        }
    }
    Panorama::new(Rgb::new(image)).ok()
}

fn of_mean_one(light: &ShLight) -> Option<ShLight> {
    let even = ShLight::even(light.order(), [1.0; 3]);
    let mean = light.coefficients()[0].iter().sum::<f64>() / 3.0 / even.coefficients()[0][0];
    (mean > 0.0 && mean.is_finite()).then(|| light.clone().tinted([1.0 / mean; 3]))
}

/// A lamp of some size, above the horizon mostly, beside which the rest may be faint.
fn add_lamp(light: &mut ShLight, random: &mut Random) {
    let mut towards = random.direction();
    if towards.z < 0.0 && random.chance(0.8) {
        towards.z = -towards.z;
    }
    let size = random.uniform(0.05..0.5);
    let strength = random.log_uniform(0.1..3.0);
    let tint: Vec3 = Vec3::from_array([(); 3].map(|()| (random.normal() * 0.15).exp()));
    let [x, y, z] = towards.to_array().map(f64::from);
    let Some(towards) = Direction::new(x, y, z) else {
        return;
    };
    let harmonics = basis(light.order(), towards);
    // A lamp whose mean radiance over the sphere is its strength.
    let scale = 4.0 * std::f64::consts::PI * f64::from(strength);
    for (at, to) in light.coefficients_mut().iter_mut().enumerate() {
        let l = at.isqrt();
        let blur = (-0.5 * (l * (l + 1)) as f64 * f64::from(size * size)).exp();
        for c in 0..3 {
            to[c] += scale * blur * harmonics[at] * f64::from(tint[c]);
        }
    }
}

/// The mirror image, left and right.
fn mirror(light: &mut ShLight) {
    for l in 0..=light.order().get() {
        for m in 1..=l {
            // cos m(π - φ) = (-1)^m cos mφ, sin m(π - φ) = -(-1)^m sin mφ.
            let sign = if m % 2 == 1 { -1.0 } else { 1.0 };
            let middle = l * (l + 1);
            let coefficients = light.coefficients_mut();
            coefficients[middle + m] = coefficients[middle + m].map(|c| c * sign);
            coefficients[middle - m] = coefficients[middle - m].map(|c| -c * sign);
        }
    }
}

/// Scales what turns m times as the table turns once.
fn scale_orders(light: &mut ShLight, factor: impl Fn(usize) -> f32) {
    for l in 0..=light.order().get() {
        for m in 1..=l {
            let middle = l * (l + 1);
            for at in [middle + m, middle - m] {
                let scaled = light.coefficients()[at].map(|c| c * f64::from(factor(m)));
                light.coefficients_mut()[at] = scaled;
            }
        }
    }
}
