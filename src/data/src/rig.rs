//! What is known of a rig: constants that are measured once, and which each of its sessions carries.

use std::fmt;
use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};

/// Elevations that a camera over a table can have, degrees: 0 from the side, 90 from above.
pub const CAMERA_ELEVATIONS_DEG: RangeInclusive<f64> = 0.0..=89.0;

/// What is known of a rig. Each field is `None` where it was not measured.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct RigFacts {
    /// Which way the table turns.
    pub rotation: Option<RotationDirection>,
    /// How high the camera looks down on the table, degrees.
    pub camera_elevation_deg: Option<f64>,
}

/// Which way the table turns as its angle grows, seen from above.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RotationDirection {
    /// Counter-clockwise: the background moves to the right.
    #[default]
    CounterClockwise,
    /// Clockwise: the background moves to the left.
    Clockwise,
}

impl RotationDirection {
    /// Both.
    pub const ALL: [Self; 2] = [Self::CounterClockwise, Self::Clockwise];

    /// Its name, as files and options have it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::CounterClockwise => "counter-clockwise",
            Self::Clockwise => "clockwise",
        }
    }

    /// The other one.
    #[must_use]
    pub const fn other(self) -> Self {
        match self {
            Self::CounterClockwise => Self::Clockwise,
            Self::Clockwise => Self::CounterClockwise,
        }
    }
}

impl fmt::Display for RotationDirection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}
