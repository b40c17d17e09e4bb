//! What is known of a turn beforehand.

use relight_core::light::{Normals, ShLight, YUp};

use crate::model::frame::Elevation;
use crate::model::material::MaterialKind;

/// What is known of a turn beforehand.
#[derive(Debug, Clone)]
pub struct TurnOptions {
    /// The camera over the table.
    pub elevation: Elevation,
    /// The light, in the viewer's frame at the table's angle 0, where it was measured; bands up to 6
    /// count, those beyond 2 for gloss alone.
    pub light: Option<ShLight>,
    /// Normals that initialise, where there are any.
    pub prior: Option<Normals<YUp>>,
    /// How much these count: `weight (1 - cos)` is added to the residual of a pixel's curve, over the energy
    /// of its variation.
    pub prior_weight: f64,
    /// The material; the one that fits the curves where it is not known.
    pub material: Option<MaterialKind>,
}

impl Default for TurnOptions {
    fn default() -> Self {
        Self {
            elevation: Elevation::assumed(),
            light: None,
            prior: None,
            prior_weight: 0.15,
            material: None,
        }
    }
}
