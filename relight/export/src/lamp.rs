//! Where the light comes from, frame by frame, where one lamp dominates. Knows nothing of files.

use relight_core::light::{Direction, Rotation, ShLight};
use relit_data::rig::RotationDirection;

use crate::error::ExportError;

/// Band 1 of a light over its band 0, for a single distant lamp.
const OF_A_LAMP: f64 = 1.732_050_807_568_877_2;
/// The part of that from which on a lamp dominates: a lamp and even light of a ninth of its irradiance, all round.
pub const LEAST_LAMP: f64 = 0.8;

/// The lamp of a turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurnLamp {
    start: Direction,
    axis: Direction,
    turn: RotationDirection,
    /// Band 1 over band 0 of the light, as a part of that of a single lamp.
    pub dominance: f64,
}

impl TurnLamp {
    /// The lamp of a light in the viewer's frame at the table's angle 0, where the camera looks down on the table by an
    /// elevation, radians.
    ///
    /// # Errors
    /// [`ExportError::NoLamp`] where there is none.
    pub fn new(
        light: &ShLight,
        elevation: f64,
        turn: RotationDirection,
    ) -> Result<Self, ExportError> {
        let coefficients = light.coefficients();
        let sum = |at: usize| -> f64 { coefficients.get(at).map_or(0.0, |rgb| rgb.iter().sum()) };
        // Band 1 is, in order, y, z and x.
        let (x, y, z) = (sum(3), sum(1), sum(2));
        let dominance = (x * x + y * y + z * z).sqrt() / (OF_A_LAMP * sum(0));
        let found = if dominance.is_finite() && sum(0) > 0.0 {
            dominance
        } else {
            0.0
        };
        let none = ExportError::NoLamp {
            found,
            needed: LEAST_LAMP,
        };
        let axis = Direction::new(0.0, elevation.cos(), elevation.sin());
        match (Direction::new(x, y, z), axis) {
            (Some(start), Some(axis)) if found >= LEAST_LAMP => Ok(Self {
                start,
                axis,
                turn,
                dominance,
            }),
            _ => Err(none),
        }
    }

    /// Where the light comes from at an angle of the table, radians: the table turns, so the lamp goes around the other
    /// way for who stands on it.
    #[must_use]
    pub fn at(&self, angle: f64) -> Direction {
        let around = match self.turn {
            RotationDirection::CounterClockwise => -angle,
            RotationDirection::Clockwise => angle,
        };
        Rotation::about(self.axis, around).apply(self.start)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_core::light::Order;
    use std::f64::consts::FRAC_PI_2;

    /// A light of some order 1 over order 0.
    fn light(x: f64, y: f64, z: f64) -> ShLight {
        let mut light = ShLight::dark(Order::TWO);
        for (at, value) in [(0, 1.0), (1, y), (2, z), (3, x)] {
            light.coefficients_mut()[at] = [value; 3];
        }
        light
    }

    #[test]
    fn a_lamp_to_the_right_is_behind_after_a_quarter_of_a_turn_counter_clockwise() {
        let turn = RotationDirection::CounterClockwise;
        let lamp = TurnLamp::new(&light(1.7, 0.0, 0.0), 0.0, turn).unwrap();
        assert!((lamp.dominance - 0.98).abs() < 0.01);
        // The background moves to the right in front of the camera, so what is to the right goes behind the camera.
        let [x, y, z] = lamp.at(FRAC_PI_2).components();
        assert!(
            x.abs() < 1e-9 && y.abs() < 1e-9 && (z - 1.0).abs() < 1e-9,
            "{x} {y} {z}"
        );
        let other =
            TurnLamp::new(&light(1.7, 0.0, 0.0), 0.0, RotationDirection::Clockwise).unwrap();
        assert!((other.at(FRAC_PI_2).components()[2] + 1.0).abs() < 1e-9);
    }

    #[test]
    fn an_even_room_has_no_lamp() {
        for room in [light(0.5, 0.5, 0.0), ShLight::dark(Order::TWO)] {
            let error = TurnLamp::new(&room, 0.3, RotationDirection::Clockwise).unwrap_err();
            assert!(matches!(error, ExportError::NoLamp { .. }), "{error}");
        }
    }
}
