//! Normals, albedo and light of a solved turn.

use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{Normals, ShLight, YUp};
use relight_core::statistics::median;

use crate::fit::figures::{BodyFigure, SenseFigure, StartFigure};
use crate::fit::material_choice::doubted;
use crate::fit::search::PixelFit;
use crate::model::frame::{Elevation, TableFrame};
use crate::model::lighting::TableLight;
use crate::model::material::BodyKind;
use crate::model::shading::Room;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;

/// Parameters of the confidence.
struct ConfidenceParameters {
    /// Expected error at which the confidence is one half, radians. By convention of the files.
    half_error: f64,
}

const PARAMETERS: ConfidenceParameters = ConfidenceParameters { half_error: 0.2 };

/// Normals, albedo and light.
#[derive(Debug, Clone)]
pub struct TurnSolution {
    /// One a pixel under the mask.
    pub(crate) fits: Vec<PixelFit>,
    /// The albedo of each pixel, which is that of its fit where its normal is to be believed.
    pub(crate) albedo: Vec<[f64; 3]>,
    /// The angle that each normal is expected to be off, radians.
    pub(crate) expected_errors: Vec<f64>,
    pub(crate) room: Room,
    pub(crate) elevation: Elevation,
    /// The light, where it was measured.
    pub(crate) measured: Option<ShLight>,
    pub(crate) starts: Vec<StartFigure>,
    pub(crate) bodies: Vec<BodyFigure>,
    pub(crate) has_prior: bool,
    pub(crate) is_prior_left_out: bool,
    pub(crate) sense: Option<SenseFigure>,
    pub(crate) given_body: Option<BodyKind>,
    pub(crate) conditioning: Conditioning,
}

impl TurnSolution {
    /// The normals in the viewer's frame.
    #[must_use]
    pub fn normals(&self, curves: &TurnCurves) -> Normals<YUp> {
        Normals::new(curves.map(|pixel| self.fits[pixel].normal.map(|v| v as f32)))
    }

    /// The albedo: in the light's units where that was known, else in such units that the mean shading of the
    /// object over the turn is 1 in each channel. Where a normal is hardly to be believed, it is that of the same colour around.
    #[must_use]
    pub fn albedo(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| self.albedo[pixel].map(|v| v as f32)))
    }

    /// The albedo that goes with each normal's shading, right or wrong.
    #[must_use]
    pub fn fitted_albedo(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| self.fits[pixel].albedo.map(|v| v as f32)))
    }

    /// The shading over the whole turn: the mean irradiance of each pixel, or what white metal would show.
    #[must_use]
    pub fn shading(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| {
            let waves = self.room.waves(self.fits[pixel].normal);
            waves.body.map(|waves| waves[0].max(0.0) as f32)
        }))
    }

    /// How far each normal is to be believed, 0 to 1: one half where it is expected to be off by 11.5 degrees.
    #[must_use]
    pub fn confidence(&self, curves: &TurnCurves) -> Planes<1> {
        curves.map(|pixel| [confidence(self.expected_errors[pixel]) as f32])
    }

    /// The light.
    #[must_use]
    pub const fn light(&self) -> &TableLight {
        &self.room.light
    }

    /// The camera over the table.
    #[must_use]
    pub const fn frame(&self) -> &TableFrame {
        &self.room.frame
    }

    /// What the object is taken for.
    #[must_use]
    pub const fn body(&self) -> BodyKind {
        self.room.body
    }

    /// What each kind of body that was tried leaves of the curves.
    #[must_use]
    pub fn bodies(&self) -> &[BodyFigure] {
        &self.bodies
    }

    /// Whether the light, of the turn and where it was given, is fit for this.
    #[must_use]
    pub const fn conditioning(&self) -> Conditioning {
        self.conditioning
    }

    /// The other kind, where one was given and the other explains clearly more.
    #[must_use]
    pub fn doubted_body(&self) -> Option<BodyKind> {
        self.given_body.and_then(|_| doubted(&self.bodies))
    }

    /// How well both senses of turning explain the curves; none where that is not told.
    #[must_use]
    pub const fn sense(&self) -> Option<SenseFigure> {
        self.sense
    }

    /// Whether the normals to start from were left out: a body inflated out of the outline agrees with the turn better.
    #[must_use]
    pub const fn is_prior_left_out(&self) -> bool {
        self.is_prior_left_out
    }

    /// How each start of an unknown light ended; none where it was known.
    #[must_use]
    pub fn starts(&self) -> &[StartFigure] {
        &self.starts
    }

    /// The median over the pixels of what is left of a curve, over the energy of its variation.
    #[must_use]
    pub fn residual(&self) -> f64 {
        median(self.fits.iter().map(|fit| fit.residual)).unwrap_or(0.0)
    }

    /// The median over the pixels of the angle that a normal is expected to be off, degrees.
    #[must_use]
    pub fn expected_error_deg(&self) -> f64 {
        median(self.expected_errors.iter().copied())
            .unwrap_or(0.0)
            .to_degrees()
    }
}

pub(crate) fn confidence(expected_error: f64) -> f64 {
    1.0 / (1.0 + (expected_error / PARAMETERS.half_error).powi(2))
}
