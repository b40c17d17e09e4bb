//! The camera over the table.

use relight_core::light::Rotation;
use relit_data::rig::CAMERA_ELEVATIONS_DEG;
use serde::Serialize;

use crate::error::TurnError;

/// Elevation where none is known, degrees. By convention of the rig.
const USUAL_DEG: f64 = 18.0;
/// Uncertainty of that one, degrees. By hand.
const USUAL_UNCERTAINTY_DEG: f64 = 8.0;
/// Uncertainty of one that was measured, degrees. By hand.
const GIVEN_UNCERTAINTY_DEG: f64 = 1.0;

/// The source of an elevation or a rotation direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FactSource {
    /// Unknown: the usual value of this rig.
    #[default]
    Assumed,
    /// The caller.
    Given,
    /// The session: it is known of the rig.
    Rig,
    /// The network of turns, whose expected errors are clearly smaller this way.
    Network,
}

/// How high the camera looks down on the table: 0 from the side, 90 degrees from above.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Elevation {
    degrees: f64,
    uncertainty_deg: f64,
    source: FactSource,
}

impl Elevation {
    /// The default for an unknown elevation: 18 ± 8 degrees.
    pub const fn assumed() -> Self {
        Self {
            degrees: USUAL_DEG,
            uncertainty_deg: USUAL_UNCERTAINTY_DEG,
            source: FactSource::Assumed,
        }
    }

    /// An elevation that was measured, degrees.
    ///
    /// # Errors
    /// If it is beyond 0 to 89 degrees.
    pub fn measured(degrees: f64) -> Result<Self, TurnError> {
        if !CAMERA_ELEVATIONS_DEG.contains(&degrees) {
            return Err(TurnError::setting(
                "the elevation",
                degrees,
                "0 to 89 degrees",
            ));
        }
        Ok(Self {
            degrees,
            uncertainty_deg: GIVEN_UNCERTAINTY_DEG,
            source: FactSource::Given,
        })
    }

    /// The elevation of the rig, as a session has it, degrees.
    ///
    /// # Errors
    /// If it is beyond 0 to 89 degrees.
    pub fn from_rig(degrees: f64) -> Result<Self, TurnError> {
        Ok(Self {
            source: FactSource::Rig,
            ..Self::measured(degrees)?
        })
    }

    /// Degrees.
    pub const fn degrees(&self) -> f64 {
        self.degrees
    }

    /// How far it may be off, degrees.
    pub const fn uncertainty_deg(&self) -> f64 {
        self.uncertainty_deg
    }

    /// Where it comes from.
    pub const fn source(&self) -> FactSource {
        self.source
    }
}

/// The frame in which the light turns: x to the camera's right, y level and away from the camera, z along
/// the table's axis, upwards (right-handed).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TableFrame {
    sin: f64,
    cos: f64,
}

impl TableFrame {
    /// The frame of a table that is seen from this elevation.
    pub fn new(elevation: Elevation) -> Self {
        let (sin, cos) = elevation.degrees.to_radians().sin_cos();
        Self { sin, cos }
    }

    /// A vector of the viewer's frame in the table's.
    pub fn to_table(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        [x, self.sin * y - self.cos * z, self.cos * y + self.sin * z]
    }

    /// The table's axis, upwards, in the viewer's frame.
    pub const fn axis(&self) -> [f64; 3] {
        [0.0, self.cos, self.sin]
    }

    /// The rotation that does the same.
    pub fn rotation(&self) -> Rotation {
        let Self { sin, cos } = *self;
        let matrix = [[1.0, 0.0, 0.0], [0.0, sin, -cos], [0.0, cos, sin]];
        // The rows are orthonormal for every angle.
        Rotation::from_matrix(matrix).unwrap_or(Rotation::IDENTITY)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_is_up_for_the_table_and_leans_to_the_viewer() {
        let frame = TableFrame::new(Elevation::measured(30.0).unwrap());
        let (sin, cos) = 30.0_f64.to_radians().sin_cos();
        let up = frame.to_table([0.0, cos, sin]);
        assert!((up[2] - 1.0).abs() < 1e-12);
        let away = frame.to_table([0.0, sin, -cos]);
        assert!((away[1] - 1.0).abs() < 1e-12);
        let apply = frame.rotation();
        let row = apply.matrix()[2];
        assert!((row[1] - cos).abs() < 1e-12 && (row[2] - sin).abs() < 1e-12);
    }

    #[test]
    fn an_elevation_beyond_what_a_camera_can_have_is_refused() {
        assert_eq!(Elevation::from_rig(20.0).unwrap().source(), FactSource::Rig);
        for degrees in [f64::NAN, 90.0, -1.0] {
            assert!(Elevation::measured(degrees).is_err());
            assert!(Elevation::from_rig(degrees).is_err());
        }
    }
}
