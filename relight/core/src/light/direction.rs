//! Unit vectors.

/// A direction in the viewer's frame: a vector of length 1, x to the right, y up, z to the viewer.
///
/// ```
/// use relight_core::light::Direction;
///
/// let lamp = Direction::new(1.0, 0.0, 1.0).unwrap();
/// assert!((lamp.dot(Direction::VIEWER) - 0.5_f64.sqrt()).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction([f64; 3]);

impl Direction {
    /// To the right, +x.
    pub const RIGHT: Self = Self([1.0, 0.0, 0.0]);
    /// To the zenith, +y.
    pub const UP: Self = Self([0.0, 1.0, 0.0]);
    /// To the viewer, +z.
    pub const VIEWER: Self = Self([0.0, 0.0, 1.0]);

    /// The direction of a vector of any length; none for a vector that has none.
    pub fn new(x: f64, y: f64, z: f64) -> Option<Self> {
        // Scaled first, so that squares neither overflow nor vanish.
        let largest = x.abs().max(y.abs()).max(z.abs());
        if !largest.is_normal() || [x, y, z].iter().any(|v| v.is_nan()) {
            return None;
        }
        let v = [x / largest, y / largest, z / largest];
        let length = dot(v, v).sqrt();
        Some(Self(v.map(|c| c / length)))
    }

    /// The direction at `polar` radians from the viewer's axis (z) and `azimuth` radians around it,
    /// from x towards y: (sin θ cos φ, sin θ sin φ, cos θ), as the paper has it.
    pub fn from_angles(polar: f64, azimuth: f64) -> Self {
        let (sin, cos) = polar.sin_cos();
        Self([sin * azimuth.cos(), sin * azimuth.sin(), cos])
    }

    /// x, y and z.
    pub const fn components(self) -> [f64; 3] {
        self.0
    }

    /// The cosine of the angle between the two.
    pub fn dot(self, other: Self) -> f64 {
        dot(self.0, other.0)
    }

    /// A unit vector from arithmetic that keeps the length.
    pub(super) const fn from_unit(components: [f64; 3]) -> Self {
        Self(components)
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_vector_without_a_direction_is_refused() {
        for v in [[0.0; 3], [f64::NAN, 1.0, 0.0], [f64::INFINITY, 0.0, 0.0]] {
            assert_eq!(Direction::new(v[0], v[1], v[2]), None, "{v:?}");
        }
    }

    #[test]
    fn tiny_and_huge_vectors_have_unit_directions() {
        for scale in [1e-200, 1.0, 1e200] {
            let d = Direction::new(3.0 * scale, 0.0, 4.0 * scale).unwrap();
            assert!((d.components()[0] - 0.6).abs() < 1e-12, "{d:?}");
        }
    }
}
