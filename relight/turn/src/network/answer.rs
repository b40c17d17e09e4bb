//! What the network of turns answers, as normals and how far they are expected to be off.

/// Range of the logarithm of the expected chord: 1 degree to all that there is.
const LOG_CHORD: (f32, f32) = (-4.0, 0.7);

/// A normal and its expected error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NetworkNormal {
    /// Unit length, in the viewer's frame; it faces the viewer.
    pub normal: [f32; 3],
    /// By how much it is expected to be off, degrees.
    pub expected_error_deg: f32,
}

impl NetworkNormal {
    /// The normal of a pixel's four numbers.
    #[must_use]
    pub fn of_answer([x, y, z, log_chord]: [f32; 4]) -> Self {
        let length = (x * x + y * y + z * z).sqrt();
        let normal = if length > 1e-9 && length.is_finite() {
            [x / length, y / length, z / length]
        } else {
            [0.0, 0.0, 1.0]
        };
        let chord = log_chord.clamp(LOG_CHORD.0, LOG_CHORD.1).exp();
        Self {
            normal,
            expected_error_deg: 2.0 * (chord / 2.0).min(1.0).asin().to_degrees(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_becomes_a_unit_normal_with_its_chord_as_an_angle() {
        let found = NetworkNormal::of_answer([0.0, 3.0, 4.0, 0.2_f32.ln()]);
        assert_eq!(found.normal, [0.0, 0.6, 0.8]);
        assert!((found.expected_error_deg - 11.48).abs() < 0.01);
        let nothing = NetworkNormal::of_answer([0.0, f32::NAN, 0.0, 0.0]);
        assert_eq!(nothing.normal, [0.0, 0.0, 1.0]);
    }
}
