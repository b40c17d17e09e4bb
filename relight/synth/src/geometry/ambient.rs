//! How much of the sky each pixel sees.

use std::f32::consts::TAU;

use glam::Vec3;

use super::{GBuffer, Occluder};
use crate::random::{mix, stream, unit_of};

/// Farthest distance at which something blocks; the object is about 2 large.
const REACH: f32 = 4.0;

impl GBuffer {
    /// For each pixel, the part of even light from all around that is not blocked, weighted by the
    /// cosine to the normal: 1 in the open. `rays` a pixel, smoothed over neighbours of the
    /// same surface.
    pub(crate) fn ambient_visibility(&self, occluder: &Occluder, rays: u32, seed: u64) -> Vec<f32> {
        let open = |k: usize| {
            let turn = unit_of(mix(stream(seed, u64::from(self.pixels[k]))));
            let (normal, start) = (self.normals[k], self.ray_starts[k]);
            let free = (0..rays).filter(|&ray| {
                let direction = cosine_direction(normal, ray, rays, turn);
                !occluder.blocks(start, direction, REACH)
            });
            free.count() as f32 / rays.max(1) as f32
        };
        let rough: Vec<f32> = (0..self.len()).map(open).collect();
        self.smoothed(&rough)
    }

    /// Mean over the neighbours (5 x 5) that lie in nearly the same plane.
    fn smoothed(&self, values: &[f32]) -> Vec<f32> {
        let side = self.size as i64;
        let numbers: Vec<usize> = (0..self.len()).collect();
        let place = self.spread(&numbers, usize::MAX);
        let near = 6.0 / side as f32;
        let mean = |k: usize| {
            let pixel = i64::from(self.pixels[k]);
            let (column, row) = (pixel % side, pixel / side);
            let (normal, point) = (self.normals[k], self.points[k]);
            let (mut sum, mut total) = (0.0, 0.0);
            for y in (row - 2).max(0)..(row + 3).min(side) {
                for x in (column - 2).max(0)..(column + 3).min(side) {
                    let other = place[(y * side + x) as usize];
                    let Some(&value) = values.get(other) else {
                        continue;
                    };
                    let alike = normal.dot(self.normals[other]).max(0.0).powi(8);
                    let off = normal.dot(self.points[other] - point) / near;
                    let weight = alike * (1.0 - off * off).max(0.0);
                    sum += value * weight;
                    total += weight;
                }
            }
            if total > 0.0 { sum / total } else { values[k] }
        };
        (0..values.len()).map(mean).collect()
    }
}

/// The `number`-th of `count` directions around the normal, denser where the cosine is larger; `turn`,
/// 0..1, turns them all.
fn cosine_direction(normal: Vec3, number: u32, count: u32, turn: f32) -> Vec3 {
    // Points of a spiral with the golden angle fill the disc evenly.
    let radius = ((number as f32 + 0.5) / count as f32).sqrt();
    let angle = TAU * (number as f32 * 0.618_034 + turn);
    let (right, up) = normal.any_orthonormal_pair();
    let (sin, cos) = angle.sin_cos();
    let height = (1.0 - radius * radius).max(0.0).sqrt();
    (right * cos + up * sin) * radius + normal * height
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Mesh, RawMesh};
    use crate::shape::ShapeKind;
    use crate::view::Projection;
    use glam::Affine3A;

    #[test]
    fn directions_have_the_moments_of_a_cosine_lobe() {
        let normal = Vec3::new(0.6, 0.0, 0.8);
        let mean: Vec3 = (0..256)
            .map(|k| cosine_direction(normal, k, 256, 0.3))
            .sum::<Vec3>()
            / 256.0;
        assert!((mean - normal * 2.0 / 3.0).length() < 0.01, "{mean}");
    }

    #[test]
    fn a_ball_sees_the_whole_sky() {
        let mesh = ShapeKind::Sphere.build(0);
        let (at, projection) = (
            Affine3A::from_scale(Vec3::splat(0.9)),
            Projection::Orthographic,
        );
        let buffer = GBuffer::render(&mesh, at, projection, 64);
        let open = buffer.ambient_visibility(&Occluder::new(&mesh, at), 32, 1);
        let mean = open.iter().sum::<f32>() / open.len() as f32;
        assert!(mean > 0.99, "{mean}");
    }

    /// The form factor of a ball of radius r, at the distance d from a point of a plane and at the
    /// angle t to its normal, is (r / d)^2 cos t as long as the ball lies wholly above the plane.
    #[test]
    fn below_a_ball_a_plane_sees_what_the_ball_leaves_of_the_sky() {
        let (radius, height) = (0.2_f32, 0.5_f32);
        let ball = ShapeKind::Sphere.build(0);
        let plane = plane();
        let buffer = GBuffer::render(&plane, Affine3A::IDENTITY, Projection::Orthographic, 64);
        let lifted = Affine3A::from_scale_rotation_translation(
            Vec3::splat(radius),
            glam::Quat::IDENTITY,
            Vec3::Z * height,
        );
        let open = buffer.ambient_visibility(&Occluder::new(&ball, lifted), 256, 5);
        for (point, open) in buffer.points.iter().zip(open) {
            let distance = (point.truncate().length_squared() + height * height).sqrt();
            let blocked = (radius / distance).powi(2) * height / distance;
            assert!(
                (1.0 - open - blocked).abs() < 0.015,
                "{point}: {open}, {blocked}"
            );
        }
    }

    fn plane() -> Mesh {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let raw = RawMesh {
            positions: corners.map(|(x, y)| Vec3::new(x, y, 0.0)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            ..RawMesh::default()
        };
        Mesh::new(raw, 1.0).unwrap()
    }
}
