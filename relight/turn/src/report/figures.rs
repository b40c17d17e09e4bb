//! The figures of a turn.

use relight_core::light::Order;
use serde::Serialize;

use crate::error::TurnError;
use crate::fit::solution::TurnSolution;
use crate::model::frame::Elevation;
use crate::model::lighting::TERMS;
use crate::model::material::MaterialKind;
use crate::network::predict::HypothesisFigures;
use crate::observe::conditioning::Conditioning;
use crate::observe::exposure::ExposureStep;
use crate::observe::reading::{ReadTurn, TableRotation};
use crate::report::maps::AngleFigure;

/// The figures of a turn, as `turn.json` holds them.
#[derive(Debug, Clone, Serialize)]
pub struct TurnFigures {
    pub(crate) schema: &'static str,
    pub(crate) software: String,
    pub(crate) turn: String,
    pub(crate) size: [usize; 2],
    pub(crate) pixels: usize,
    pub(crate) frames: u32,
    pub(crate) lost: Vec<String>,
    pub(crate) has_angles: bool,
    pub(crate) clipped: f64,
    pub(crate) elevation: Elevation,
    /// Which way the table was taken to turn, and what says so.
    pub(crate) rotation: TableRotation,
    pub(crate) conditioning: Conditioning,
    pub(crate) advice: Option<&'static str>,
    /// Where the light is from: a file, or the ball; none where it was found.
    pub(crate) light_source: Option<String>,
    /// What the object is taken for.
    pub(crate) material: MaterialKind,
    /// What the network of turns took the turn for.
    pub(crate) network: HypothesisFigures,
    /// The residual of a curve, over the energy of its variation, the median.
    pub(crate) residual: f64,
    /// The angle that normals are expected to be off, degrees, the median.
    pub(crate) expected_error_deg: f64,
    /// Specular reflectance and smoothness of the whole object, as `relight render` takes them; none for a Lambertian
    /// one.
    pub(crate) gloss: Option<FigureGloss>,
    pub(crate) exposure_steps: Vec<ExposureStep>,
    pub(crate) white: FigureWhites,
    pub(crate) over_angle: Vec<AngleFigure>,
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct FigureGloss {
    pub(crate) reflectance: f32,
    pub(crate) smoothness: f32,
    /// What no such gloss fits of the one that was found, as a part of it, effective value.
    pub(crate) residual: f64,
}

/// The light that the largest value of a file stands for.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct FigureWhites {
    pub(crate) albedo: f32,
    pub(crate) shading: f32,
}

/// The light, as `light.json` holds it.
#[derive(Serialize)]
pub(crate) struct LightFile {
    pub(crate) schema: &'static str,
    pub(crate) frame: &'static str,
    pub(crate) order: usize,
    /// Red, green and blue of each coefficient (l, m), at l (l + 1) + m.
    pub(crate) coefficients: Vec<[f64; 3]>,
    /// e, f, g, Re a, Im a, Re b, Im b, Re d, Im d of each channel.
    pub(crate) terms: [[f64; TERMS]; 3],
    pub(crate) elevation: Elevation,
    /// Which way the table was taken to turn as its angle grows: the light turns the other way.
    pub(crate) rotation: TableRotation,
}

impl TurnFigures {
    /// How many frames were read.
    #[must_use]
    pub const fn frames(&self) -> u32 {
        self.frames
    }

    /// How many degrees of the turn they cover.
    #[must_use]
    pub const fn coverage_deg(&self) -> f64 {
        self.conditioning.coverage_deg
    }
}

impl LightFile {
    /// That of a solved turn.
    pub(crate) fn new(turn: &ReadTurn, solution: &TurnSolution) -> Result<Self, TurnError> {
        let light = solution.light();
        Ok(Self {
            schema: "relight.table_light/1",
            frame: "table: x right, y away from the camera, z up the axis; at the table's angle 0",
            order: Order::TWO.get(),
            coefficients: light.coefficients()?.coefficients().to_vec(),
            terms: *light.terms(),
            elevation: solution.elevation,
            rotation: turn.rotation,
        })
    }
}
