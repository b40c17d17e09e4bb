//! Planes to draw on, and edges that are not jagged.

use glam::{Vec2, Vec3};
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

    pub(super) fn place(&self, point: Vec3) -> Vec2 {
        let from = point - self.origin;
        Vec2::new(from.dot(self.right), from.dot(self.up))
    }
}

/// 0 below, 1 above, and a ramp of this width around 0.
pub(super) fn step(value: f32, width: f32) -> f32 {
    (value / width + 0.5).clamp(0.0, 1.0)
}
