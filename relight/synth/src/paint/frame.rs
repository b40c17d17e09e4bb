//! Planes to draw on, and edges that are not jagged.

use glam::{Mat3, Vec2, Vec3};
use serde::{Deserialize, Serialize};

use super::super::random::Random;

/// A plane with two axes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub(super) struct Frame {
    origin: Vec3,
    right: Vec3,
    up: Vec3,
}

impl Frame {
    /// Around a point of the surface, seen from anywhere; `scale` is the length of one unit.
    pub(super) fn draw(random: &mut Random, origin: Vec3, scale: f32) -> Self {
        let turn = random.rotation();
        Self {
            origin,
            right: turn.x_axis / scale,
            up: turn.y_axis / scale,
        }
    }

    /// Around a point of the surface, seen along the surface's normal there: what is drawn on it is not stretched.
    /// `points` are those of the surface, in no order.
    pub(super) fn along_surface(
        random: &mut Random,
        points: &[Vec3],
        origin: Vec3,
        scale: f32,
    ) -> Self {
        let normal =
            normal_of_neighbours(points, origin, 2.0 * scale).unwrap_or_else(|| random.direction());
        let right = normal.any_orthonormal_vector();
        let turn = random.uniform(0.0..std::f32::consts::TAU);
        let (sin, cos) = turn.sin_cos();
        let up = normal.cross(right);
        Self {
            origin,
            right: (right * cos + up * sin) / scale,
            up: (up * cos - right * sin) / scale,
        }
    }

    /// The same plane with its origin elsewhere, and another unit.
    pub(super) fn shifted(&self, by: Vec2, scale: f32) -> Self {
        let unit = |axis: Vec3| axis / axis.length_squared().max(1e-12);
        Self {
            origin: self.origin + unit(self.right) * by.x + unit(self.up) * by.y,
            right: self.right / scale,
            up: self.up / scale,
        }
    }

    /// The length of its unit along x, object units.
    pub(super) fn unit(&self) -> f32 {
        1.0 / self.right.length().max(1e-6)
    }

    pub(super) fn place(&self, point: Vec3) -> Vec2 {
        let from = point - self.origin;
        Vec2::new(from.dot(self.right), from.dot(self.up))
    }
}

/// Neighbours that a normal needs.
const MIN_NEIGHBOURS: usize = 8;

/// The direction in which the points within `radius` of `origin` vary least, up to its sign. `None` if there are too
/// few of them.
fn normal_of_neighbours(points: &[Vec3], origin: Vec3, radius: f32) -> Option<Vec3> {
    let near = |point: &&Vec3| point.distance_squared(origin) < radius * radius;
    // Every so many are enough.
    let stride = points.len() / 4000 + 1;
    let around: Vec<Vec3> = points
        .iter()
        .step_by(stride)
        .filter(near)
        .copied()
        .collect();
    if around.len() < MIN_NEIGHBOURS {
        return None;
    }
    let mean = around.iter().sum::<Vec3>() / around.len() as f32;
    let mut covariance = Mat3::ZERO;
    for point in &around {
        let from = *point - mean;
        covariance += Mat3::from_cols(from * from.x, from * from.y, from * from.z);
    }
    let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
    // The largest eigenvalue of this matrix is the smallest of the covariance.
    let mut power = Mat3::from_diagonal(Vec3::splat(trace)) - covariance;
    for _ in 0..6 {
        power = power * power * (1.0 / power.x_axis.length().max(1e-20).powi(2));
    }
    let columns = [power.x_axis, power.y_axis, power.z_axis];
    let longest = columns
        .into_iter()
        .max_by(|a, b| a.length().total_cmp(&b.length()))?;
    longest.try_normalize()
}

/// 0 below, 1 above, and a ramp of this width around 0.
pub(super) fn step(value: f32, width: f32) -> f32 {
    (value / width + 0.5).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_along_a_surface_lies_in_its_tangent_plane() {
        let mut random = Random::new(4);
        let points: Vec<Vec3> = (0..4000).map(|_| random.direction()).collect();
        for _ in 0..20 {
            let origin = random.direction();
            let frame = Frame::along_surface(&mut random, &points, origin, 0.15);
            let normal = frame.right.cross(frame.up).normalize();
            assert!(normal.dot(origin).abs() > 0.97, "{normal} {origin}");
            assert!((frame.right.length() * 0.15 - 1.0).abs() < 1e-4);
        }
        let alone = Frame::along_surface(&mut random, &[], Vec3::X, 0.2);
        assert!(alone.right.is_finite() && alone.up.is_finite());
    }

    #[test]
    fn a_shifted_frame_has_its_origin_where_it_was_told() {
        let mut random = Random::new(6);
        let frame = Frame::draw(&mut random, Vec3::new(0.1, 0.2, 0.3), 0.5);
        let shifted = frame.shifted(Vec2::new(1.0, -2.0), 0.25);
        let at = frame.place(shifted.origin);
        assert!((at - Vec2::new(1.0, -2.0)).length() < 1e-4, "{at}");
        assert!((shifted.right.length() / frame.right.length() - 4.0).abs() < 1e-4);
    }
}
