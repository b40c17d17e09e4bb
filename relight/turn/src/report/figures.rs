//! The figures of a turn.

use relight_core::light::Order;
use serde::Serialize;

use crate::error::TurnError;
use crate::fit::azimuth::AzimuthFigures;
use crate::fit::figures::{DirectionFigure, InitialisationFigure, MaterialFigure};
use crate::fit::solution::TurnSolution;
use crate::model::frame::Elevation;
use crate::model::lighting::{TERMS, TableLight};
use crate::model::material::MaterialKind;
use crate::network::predict::HypothesisFigures;
use crate::observe::conditioning::Conditioning;
use crate::observe::exposure::ExposureStep;
use crate::observe::reading::{ReadTurn, RotationDirection, TableRotation};
use crate::observe::strip::{PanoramaStrip, StripFigures};
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
    pub(crate) normals: Option<String>,
    /// Whether these normals were left out: a shape inflated out of the outline fits the turn better.
    pub(crate) normals_left_out: bool,
    pub(crate) light: FigureLight,
    /// What the object is taken for, and the residual of each kind that was tried.
    #[serde(rename = "body")]
    pub(crate) material: MaterialKind,
    #[serde(rename = "bodies")]
    pub(crate) materials: Vec<MaterialFigure>,
    /// How well both rotation directions fit the turn; none where that is not observable.
    #[serde(rename = "sense")]
    pub(crate) direction: Option<DirectionFigure>,
    /// What the network of turns took the turn for; none where it was not asked.
    pub(crate) network: Option<HypothesisFigures>,
    /// From which side the light comes, by all that says so; none where no network of turns was asked.
    pub(crate) azimuth: Option<AzimuthFigures>,
    /// The residual of a curve, over the energy of its variation, the median.
    pub(crate) residual: f64,
    /// The angle that normals are expected to be off, degrees, the median.
    pub(crate) expected_error_deg: f64,
    /// Specular reflectance and smoothness of the whole object, as `relight render` takes them; none for a Lambertian
    /// one.
    pub(crate) gloss: Option<FigureGloss>,
    /// Which ambiguity nothing broke.
    pub(crate) ambiguity: Option<&'static str>,
    pub(crate) exposure_steps: Vec<ExposureStep>,
    /// What the panorama strip says; none where the video was not read, or its sides do not show the same environment.
    #[serde(rename = "room")]
    pub(crate) panorama: Option<FigurePanorama>,
    pub(crate) white: FigureWhites,
    pub(crate) over_angle: Vec<AngleFigure>,
}

/// The surroundings by the background of the video, beside the light that was fitted.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct FigurePanorama {
    #[serde(flatten)]
    strip: StripFigures,
    /// The light's bright side, as that of the strip.
    light_azimuth_deg: f64,
    /// How far the two are apart, degrees.
    apart_deg: f64,
}

impl FigurePanorama {
    /// Of a strip that was made with a rotation; it tells the direction of the shard's own angle.
    pub(crate) fn new(strip: &PanoramaStrip, light: &TableLight, rotation: TableRotation) -> Self {
        let mut strip = *strip.figures();
        let light_azimuth_deg = light.bright_azimuth_deg();
        let apart = (strip.bright_azimuth_deg - light_azimuth_deg).rem_euclid(360.0);
        if rotation.direction == RotationDirection::Clockwise {
            strip.direction = strip.direction.other();
        }
        Self {
            strip,
            light_azimuth_deg,
            apart_deg: apart.min(360.0 - apart),
        }
    }
}

#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct FigureGloss {
    pub(crate) reflectance: f32,
    pub(crate) smoothness: f32,
    /// What no such gloss fits of the one that was found, as a part of it, effective value.
    pub(crate) residual: f64,
}

#[derive(Debug, Clone, Serialize)]
pub(crate) struct FigureLight {
    pub(crate) source: Option<String>,
    #[serde(rename = "starts")]
    pub(crate) initialisations: Vec<InitialisationFigure>,
}

/// The light that the largest value of a file stands for.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct FigureWhites {
    pub(crate) albedo: f32,
    pub(crate) shading: f32,
    pub(crate) highlight: f32,
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
