//! Figures of what was tried.

use relight_core::statistics::median;
use serde::Serialize;

use crate::fit::search::PixelFit;
use crate::model::material::MaterialKind;

/// How well a material fits a turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MaterialFigure {
    /// The kind.
    #[serde(rename = "body")]
    pub material: MaterialKind,
    /// The residual of a curve, over the energy of its variation: the median over blocks of pixels.
    pub residual: f64,
}

impl MaterialFigure {
    pub(crate) fn new(material: MaterialKind, fits: &[PixelFit]) -> Self {
        Self {
            material,
            residual: median(fits.iter().map(|fit| fit.residual)).unwrap_or(0.0),
        }
    }
}

/// How an initialisation ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct InitialisationFigure {
    /// Its name.
    #[serde(rename = "start")]
    pub name: String,
    /// What it left of the curves, with what its normals are off the prior.
    pub residual: f64,
    /// Whether its light was taken.
    pub taken: bool,
}

/// Parameters of the doubt in the rotation direction.
struct DirectionParameters {
    /// Residual up to which a direction is not doubted, over the energy of the variation. By hand.
    explained: f64,
    /// Largest part of that residual with which the other direction is clearly better. Measured: the right one has 0.69
    /// on the boot of docs/results/turns.md.
    clearly: f64,
}

const PARAMETERS: DirectionParameters = DirectionParameters {
    explained: 0.02,
    clearly: 0.75,
};

/// How well both rotation directions fit the curves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DirectionFigure {
    /// The residual of the one that was taken on blocks of pixels, with what the normals are off the prior mean.
    pub residual: f64,
    /// The same of the other one.
    pub other_residual: f64,
}

impl DirectionFigure {
    /// Whether the other rotation direction fits clearly better.
    #[must_use]
    pub fn is_doubted(&self) -> bool {
        self.residual > PARAMETERS.explained
            && self.other_residual < PARAMETERS.clearly * self.residual
    }
}
