//! The rays of a view: which directions the object and the plate keep from each pixel.

use glam::{Mat3, Vec3};
use rayon::prelude::*;
use relight_core::light::{Order, basis_into};

use super::{BOUNCE_COEFFICIENTS, COEFFICIENTS, TRANSFER_ORDER, band, cosine_band};
use crate::geometry::{GBuffer, Occluder};
use crate::random::Random;

/// Sets of directions, each turned otherwise: pixels beside each other have different ones.
const SETS: usize = 16;

/// The table's frame of a camera at this elevation, radians: rows are its axes in the viewer's frame.
pub(super) fn table_frame(elevation: f32) -> Mat3 {
    let (sin, cos) = elevation.sin_cos();
    Mat3::from_cols(
        Vec3::new(1.0, 0.0, 0.0),
        Vec3::new(0.0, sin, cos),
        Vec3::new(0.0, -cos, sin),
    )
}

/// The harmonics at a direction of the table's frame.
pub(super) fn harmonics_at<const N: usize>(order: Order, at: Vec3) -> [f32; N] {
    let mut values = [0.0; N];
    basis_into(order, at.to_array().map(f64::from), &mut values);
    values.map(|value| value as f32)
}

/// Directions that all pixels of a set share.
struct Directions {
    towards: Vec<Vec3>,
    /// In the table's frame.
    harmonics: Vec<[f32; COEFFICIENTS]>,
}

impl Directions {
    /// A spiral of directions over the sphere, turned at random; given in the viewer's frame.
    fn draw(random: &mut Random, count: u32, to_table: Mat3) -> Self {
        let turn = random.rotation();
        let golden = std::f32::consts::PI * (1.0 + 5.0_f32.sqrt());
        let towards: Vec<Vec3> = (0..count)
            .map(|k| {
                let z = 1.0 - (2 * k + 1) as f32 / count as f32;
                let (sin, cos) = (golden * (k as f32 + 0.5)).sin_cos();
                let radius = (1.0 - z * z).max(0.0).sqrt();
                turn * Vec3::new(radius * cos, radius * sin, z)
            })
            .collect();
        let harmonics = towards
            .iter()
            .map(|&towards| harmonics_at(TRANSFER_ORDER, to_table * towards))
            .collect();
        Self { towards, harmonics }
    }
}

/// Casts the rays of each covered pixel; harmonics are those of the frame into which `to_frame` takes the viewer's.
pub(super) fn cast_pixels(
    buffer: &GBuffer,
    occluder: &Occluder,
    to_frame: Mat3,
    rays: u32,
    seed: u64,
) -> Vec<PixelRays> {
    let mut random = Random::new(seed);
    let sets: Vec<Directions> = (0..SETS)
        .map(|_| Directions::draw(&mut random, rays, to_frame))
        .collect();
    let cast = |k: usize| {
        let pixel = buffer.pixels[k];
        let (column, row) = (pixel % buffer.size, pixel / buffer.size);
        let set = &sets[(column % 4 + 4 * (row % 4)) as usize % SETS];
        PixelRays::cast(buffer, occluder, k, set, to_frame)
    };
    (0..buffer.len()).into_par_iter().map(cast).collect()
}

/// What the rays of a pixel found.
pub(super) struct PixelRays {
    pub(super) mirrors: bool,
    pub(super) blocked: [f32; COEFFICIENTS],
    pub(super) bounced: [f32; BOUNCE_COEFFICIENTS],
}

impl PixelRays {
    fn cast(
        buffer: &GBuffer,
        occluder: &Occluder,
        k: usize,
        directions: &Directions,
        to_table: Mat3,
    ) -> Self {
        let (normal, eye) = (buffer.normals[k], buffer.towards_eye[k]);
        let from = buffer.ray_starts[k];
        let mirrored = normal * (2.0 * normal.dot(eye)) - eye;
        let mut found = Self {
            mirrors: !occluder.blocks(from, mirrored, f32::INFINITY),
            blocked: [0.0; COEFFICIENTS],
            bounced: [0.0; BOUNCE_COEFFICIENTS],
        };
        let share = 4.0 * std::f32::consts::PI / directions.towards.len() as f32;
        for (&towards, harmonics) in directions.towards.iter().zip(&directions.harmonics) {
            let cosine = normal.dot(towards);
            if cosine <= 0.0 {
                continue;
            }
            let Some(hit) = occluder.first_hit(from, towards) else {
                continue;
            };
            let part = cosine * share;
            for (sum, harmonic) in found.blocked.iter_mut().zip(harmonics) {
                *sum += part * harmonic;
            }
            if let Some(there) = hit.normal {
                let there: [f32; BOUNCE_COEFFICIENTS] = harmonics_at(Order::TWO, to_table * there);
                for (at, (sum, harmonic)) in found.bounced.iter_mut().zip(there).enumerate() {
                    *sum += part * harmonic * cosine_band(band(at)) / std::f32::consts::PI;
                }
            }
        }
        found
    }
}
