//! Directions of relight-core as vectors of glam, and back.

use glam::Vec3;
use relight_core::light::Direction;

/// The direction of a vector that has a length; to the viewer where it has none.
pub(super) fn direction(vector: Vec3) -> Direction {
    let [x, y, z] = vector.to_array().map(f64::from);
    Direction::new(x, y, z).unwrap_or(Direction::VIEWER)
}

/// The unit vector of a direction.
pub(super) fn vector(direction: Direction) -> Vec3 {
    Vec3::from_array(direction.components().map(|c| c as f32))
}
