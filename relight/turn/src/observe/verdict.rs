//! What follows from the conditioning of a turn.

use serde::Serialize;

/// Whether normals and albedo are to be expected from the turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum LightVerdict {
    /// The light has a bright side.
    Good,
    /// The light is nearly the same from everywhere.
    TooEven,
    /// Most of what varies is shadows or highlights.
    #[serde(rename = "not_matt")]
    NotLambertian,
    /// Nearly all of the object is clipped over half of the turn or more.
    Overexposed,
    /// Nearly all of the object is black.
    Underexposed,
    /// The light that was found would have to be negative somewhere.
    ImpossibleLight,
}

impl LightVerdict {
    /// Whether normals and albedo are observable at all.
    #[must_use]
    pub const fn is_fit(self) -> bool {
        matches!(self, Self::Good | Self::NotLambertian)
    }

    /// What to do about it, in one sentence; none where all is well.
    #[must_use]
    pub const fn advice(self) -> Option<&'static str> {
        match self {
            Self::Good => None,
            Self::TooEven => Some(
                "the environment light is too even for normals and albedo: turn on one lamp at the side, and capture the turn again",
            ),
            Self::NotLambertian => Some(
                "most of what varies over the turn is shadows or highlights, which the normals do not explain: \
                 do not trust them where the confidence is low",
            ),
            Self::Overexposed => Some(
                "the object is overexposed: nearly all of it is clipped over half of the turn or more; \
                 shorten the exposure or lower the gain, and capture the turn again",
            ),
            Self::Underexposed => Some(
                "the object is underexposed: nearly all of it is black; \
                 lengthen the exposure or add light, and capture the turn again",
            ),
            Self::ImpossibleLight => Some(
                "no light explains the turn: the one that fits it best would be negative from some side; \
                 do not trust light and albedo, and the normals as far as their confidence says, or give the light (--light, --probe)",
            ),
        }
    }
}
