//! What is known of a rig: constants that are measured once, and which each of its sessions carries.

mod rotation_direction;

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

pub use rotation_direction::RotationDirection;

/// Elevations that a camera over a table can have, degrees: 0 from the side, 90 from above.
pub const CAMERA_ELEVATIONS_DEG: RangeInclusive<f64> = 0.0..=89.0;

/// What is known of a rig. Each field is `None` where it was not measured.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RigFacts {
    /// Which way the table turns.
    #[serde(default)]
    pub rotation: Option<RotationDirection>,
    /// How high the camera looks down on the table, degrees.
    #[serde(default)]
    pub camera_elevation_deg: Option<f64>,
}
