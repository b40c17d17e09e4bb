//! What is known of a turn beforehand.

use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{Normals, ShLight, YUp};

use crate::fit::prior::mean_albedo;
use crate::model::frame::Elevation;
use crate::model::material::MaterialKind;
use crate::network::predict::{HypothesisFigures, TurnPrediction};
use crate::observe::strip::StripFigures;

/// What is expected of the object before a turn is solved.
#[derive(Debug, Clone)]
pub struct TurnPrior {
    /// Unit normals.
    pub normals: Normals<YUp>,
    /// By how much each is expected to be off, degrees, where that is known: then a normal counts the more, the
    /// surer it is.
    pub expected_errors: Option<Planes<1>>,
    /// The albedo that is expected, each channel in any unit: what a pixel has whose normal is hardly to be trusted, and
    /// so its shading.
    pub albedo: Option<Rgb<Linear>>,
    /// What the network of turns took the turn for, where the normals are its own.
    pub hypotheses: Option<HypothesisFigures>,
}

impl TurnPrior {
    /// The same with the albedo that a network of photographs sees, or the mean of it and that which there is.
    #[must_use]
    pub fn with_albedo_of_photographs(self, seen: Rgb<Linear>, mask: &Planes<1>) -> Self {
        let albedo = match &self.albedo {
            Some(own) => mean_albedo(own, &seen, mask),
            None => seen,
        };
        Self {
            albedo: Some(albedo),
            ..self
        }
    }
}

impl From<Normals<YUp>> for TurnPrior {
    fn from(normals: Normals<YUp>) -> Self {
        Self {
            normals,
            expected_errors: None,
            albedo: None,
            hypotheses: None,
        }
    }
}

impl From<TurnPrediction> for TurnPrior {
    fn from(found: TurnPrediction) -> Self {
        Self {
            normals: found.normals,
            expected_errors: Some(found.expected_errors),
            albedo: Some(found.albedo),
            hypotheses: Some(found.hypotheses),
        }
    }
}

/// What is known of a turn beforehand.
#[derive(Debug, Clone)]
pub struct TurnOptions {
    /// The camera over the table.
    pub elevation: Elevation,
    /// The light, in the viewer's frame at the table's angle 0, where it was measured; bands up to 6
    /// count, those beyond 2 for gloss alone.
    pub light: Option<ShLight>,
    /// Normals that initialise, where there are any.
    pub prior: Option<TurnPrior>,
    /// How much these count: `weight (1 - cos)` is added to the residual of a pixel's curve, over the energy
    /// of its variation.
    pub prior_weight: f64,
    /// The material; the one that fits the curves where it is not known.
    pub material: Option<MaterialKind>,
    /// The surroundings by the background of the video, where it was read: they help to say from which side the light
    /// comes.
    pub panorama: Option<StripFigures>,
}

impl Default for TurnOptions {
    fn default() -> Self {
        Self {
            elevation: Elevation::assumed(),
            light: None,
            prior: None,
            prior_weight: 0.15,
            material: None,
            panorama: None,
        }
    }
}
