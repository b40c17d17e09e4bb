//! Which way a table turns.

use std::fmt;

use serde::{Deserialize, Serialize};

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
