//! Rotations of directions.

use super::Direction;

/// How far the product of a matrix with its transpose may be from the identity.
const TOLERANCE: f64 = 1e-9;

/// A rotation about the origin of the viewer's frame.
///
/// ```
/// use std::f64::consts::FRAC_PI_2;
/// use relight_core::light::{Direction, Rotation};
///
/// // A quarter turn about the vertical axis brings the light at the viewer to the right.
/// let turn = Rotation::about(Direction::UP, FRAC_PI_2);
/// assert!(turn.apply(Direction::VIEWER).dot(Direction::RIGHT) > 1.0 - 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rotation([[f64; 3]; 3]);

impl Rotation {
    /// No rotation.
    pub const IDENTITY: Self = Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);

    /// The rotation by `radians` about `axis`, counter-clockwise for who looks against the axis
    /// (the right-hand rule).
    pub fn about(axis: Direction, radians: f64) -> Self {
        let [x, y, z] = axis.components();
        let (s, c) = radians.sin_cos();
        let t = 1.0 - c;
        Self([
            [t * x * x + c, t * x * y - s * z, t * x * z + s * y],
            [t * x * y + s * z, t * y * y + c, t * y * z - s * x],
            [t * x * z - s * y, t * y * z + s * x, t * z * z + c],
        ])
    }

    /// The rotation with this matrix, row by row; `None` if the matrix is not a rotation.
    pub fn from_matrix(matrix: [[f64; 3]; 3]) -> Option<Self> {
        let rotation = Self(matrix);
        let product = rotation.after(&rotation.inverse()).0;
        let is_identity = (0..3).all(|i| {
            (0..3).all(|j| (product[i][j] - f64::from(u8::from(i == j))).abs() < TOLERANCE)
        });
        (is_identity && determinant(&matrix) > 0.0).then_some(rotation)
    }

    /// A matrix that is known to be a rotation.
    pub(super) const fn from_known(matrix: [[f64; 3]; 3]) -> Self {
        Self(matrix)
    }

    /// The matrix, row by row: it is multiplied with a column.
    pub const fn matrix(&self) -> &[[f64; 3]; 3] {
        &self.0
    }

    /// The direction after the rotation.
    pub fn apply(&self, direction: Direction) -> Direction {
        let v = direction.components();
        Direction::from_unit(
            self.0
                .map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2]),
        )
    }

    /// The rotation that does `first`, then this one.
    pub fn after(&self, first: &Self) -> Self {
        let cell = |i: usize, j: usize| (0..3).map(|k| self.0[i][k] * first.0[k][j]).sum();
        Self([0, 1, 2].map(|i| [0, 1, 2].map(|j| cell(i, j))))
    }

    /// The rotation back.
    pub fn inverse(&self) -> Self {
        Self([0, 1, 2].map(|i| [0, 1, 2].map(|j| self.0[j][i])))
    }
}

fn determinant(m: &[[f64; 3]; 3]) -> f64 {
    let minor = |a: usize, b: usize| m[1][a] * m[2][b] - m[1][b] * m[2][a];
    m[0][0] * minor(1, 2) - m[0][1] * minor(0, 2) + m[0][2] * minor(0, 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_rotation_and_its_inverse_cancel() {
        let axis = Direction::new(1.0, -2.0, 0.5).unwrap();
        let turn = Rotation::about(axis, 1.1);
        let back = turn.inverse().after(&turn);
        assert!(Rotation::from_matrix(*back.matrix()).is_some());
        assert!((back.matrix()[0][0] - 1.0).abs() < 1e-12);
        assert!(turn.apply(axis).dot(axis) > 1.0 - 1e-12);
    }

    #[test]
    fn rotations_follow_the_right_hand_rule() {
        let about_z = Rotation::about(Direction::VIEWER, FRAC_PI_2);
        assert!(about_z.apply(Direction::RIGHT).dot(Direction::UP) > 1.0 - 1e-12);
    }

    #[test]
    fn mirrors_and_stretched_matrices_are_no_rotations() {
        let mirror = [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(Rotation::from_matrix(mirror), None);
        let stretched = [[2.0, 0.0, 0.0], [0.0, 0.5, 0.0], [0.0, 0.0, 1.0]];
        assert_eq!(Rotation::from_matrix(stretched), None);
        assert_eq!(Rotation::from_matrix([[f64::NAN; 3]; 3]), None);
    }
}
