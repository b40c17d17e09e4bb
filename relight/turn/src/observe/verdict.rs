//! What follows from the conditioning of a turn.

use serde::Serialize;

/// Whether normals and albedo are to be expected from the turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TurnVerdict {
    /// They are.
    Good,
    /// A light that is known is nearly the same from everywhere.
    TooEven,
    /// Most of what varies in a light that is known is shadows or highlights.
    NotLambertian,
    /// Nearly all of the object is clipped over half of the turn or more.
    Overexposed,
    /// Nearly all of the object is black.
    Underexposed,
    /// The frames cover only part of a turn, in a light that is not known.
    PartOfTurn,
    /// Normals in a light that is not known are expected to be far off.
    Uncertain,
}

impl TurnVerdict {
    /// Whether normals and albedo are observable at all.
    pub const fn is_fit(self) -> bool {
        matches!(self, Self::Good | Self::NotLambertian | Self::Uncertain)
    }

    /// What to do if the camera's exposure makes the turn useless.
    pub(crate) const fn exposure_advice(self) -> Option<&'static str> {
        match self {
            Self::Overexposed | Self::Underexposed => self.advice(),
            _ => None,
        }
    }

    /// What to do about it, in one sentence; `None` if all is well.
    pub const fn advice(self) -> Option<&'static str> {
        match self {
            Self::Good => None,
            Self::TooEven => Some(
                "the environment light is too even for normals and albedo: turn on one lamp at the side, and capture again",
            ),
            Self::NotLambertian => Some(
                "most of the variation is shadows or highlights, which the normals do not explain: do not trust them where \
                 the confidence is low",
            ),
            Self::Overexposed => Some(
                "the object is overexposed: nearly all of it is clipped for half the turn or more; lower exposure or \
                 gain, and capture again",
            ),
            Self::Underexposed => Some(
                "the object is underexposed: nearly all of it is black; \
                 lengthen the exposure or add light, and capture the turn again",
            ),
            Self::PartOfTurn => Some(
                "the frames cover only part of a turn: do not trust normals where the confidence is low, or capture a whole turn",
            ),
            Self::Uncertain => Some(
                "the network of turns is uncertain of the normals: do not trust them where the confidence is low; for a black \
                 or metal object, measure the light (--light-ball)",
            ),
        }
    }
}
