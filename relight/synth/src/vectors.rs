//! Directions and rotations of relight-core as vectors and matrices of glam, and back.

use glam::{DMat3, DQuat, Mat3, Vec3};
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

/// The rows of a rotation, exact to the last bit of an `f64`: as [`Rotation::from_matrix`] asks for, which refuses what
/// a matrix of `f32` rounds.
///
/// [`Rotation::from_matrix`]: relight_core::light::Rotation::from_matrix
pub(super) fn rotation_rows(turn: Mat3) -> [[f64; 3]; 3] {
    let turn = DQuat::from_mat3(&turn.as_dmat3()).normalize();
    DMat3::from_quat(turn).transpose().to_cols_array_2d()
}
