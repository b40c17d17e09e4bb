//! What an object can be made of.

use serde::Serialize;

/// What gives an object its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyKind {
    /// It scatters light evenly, and may have gloss that shows the light as it is: plastic, wood, stone, leather.
    Diffuse,
    /// It has no matt part, and its reflection is coloured: bronze, steel, gold.
    Metal,
}
