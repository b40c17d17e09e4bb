//! Figures of what was tried.

use relight_core::statistics::median;
use serde::Serialize;

use crate::fit::search::PixelFit;
use crate::model::material::BodyKind;

/// How well a kind of body explains a turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BodyFigure {
    /// The kind.
    pub body: BodyKind,
    /// What it leaves of a curve, over the energy of its variation: the median over blocks of pixels.
    pub residual: f64,
}

impl BodyFigure {
    pub(crate) fn new(body: BodyKind, fits: &[PixelFit]) -> Self {
        Self {
            body,
            residual: median(fits.iter().map(|fit| fit.residual)).unwrap_or(0.0),
        }
    }
}

/// How a start ended.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StartFigure {
    /// Its name.
    pub start: String,
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

/// How well both senses in which the table can turn explain the curves.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SenseFigure {
    /// What the one that was taken leaves of the curves of blocks of pixels, with what the normals are off the prior.
    pub residual: f64,
    /// The same of the other one.
    pub other_residual: f64,
}

impl SenseFigure {
    /// Whether the other sense explains clearly more.
    #[must_use]
    pub fn is_doubted(&self) -> bool {
        self.residual > PARAMETERS.explained
            && self.other_residual < PARAMETERS.clearly * self.residual
    }
}
