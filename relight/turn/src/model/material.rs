//! What an object can be made of.

use std::fmt;

use serde::Serialize;

/// What gives an object its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum MaterialKind {
    /// It scatters light evenly, and may have gloss that shows the light as it is: plastic, wood, stone, leather.
    #[default]
    Diffuse,
    /// It has no diffuse part, and its reflection is coloured: bronze, steel, gold.
    Metal,
}

impl fmt::Display for MaterialKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Diffuse => "diffuse",
            Self::Metal => "metal",
        })
    }
}
