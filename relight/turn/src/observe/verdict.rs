//! What follows from the conditioning of a turn.

use serde::Serialize;

/// Whether normals and albedo are to be expected from the turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TurnVerdict {
    /// They are.
    Good,
    /// The frames cover only part of a turn.
    PartOfTurn,
    /// Normals are expected to be far off, or the object is metal.
    Uncertain,
}

impl TurnVerdict {
    /// Whether normals and albedo are observable at all.
    pub const fn is_fit(self) -> bool {
        matches!(self, Self::Good | Self::Uncertain)
    }

    /// What to do about it, in one sentence; `None` if all is well.
    pub const fn advice(self) -> Option<&'static str> {
        match self {
            Self::Good => None,
            Self::PartOfTurn => Some(
                "the frames cover only part of a turn: do not trust normals where the confidence is low, or capture a whole turn",
            ),
            Self::Uncertain => Some(
                "the normals are uncertain, as the network expects large errors or the object is metal: do not trust them where the \
                 confidence is low; a measured light helps (--light-ball)",
            ),
        }
    }
}
