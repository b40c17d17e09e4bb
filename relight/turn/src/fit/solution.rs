//! Normals, albedo and light of a solved turn.

use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{LightError, Normals, Order, ShLight, YUp};
use relight_core::render::mirror_reflectance;
use relit_data::statistics::median;
use serde::Serialize;

use crate::fit::search::PixelFit;
use crate::model::frame::Elevation;
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;
use crate::observe::verdict::TurnVerdict;

/// Expected error at which the confidence is one half, radians. By convention of the files.
const HALF_ERROR: f64 = 0.2;

/// Normals, albedo and light.
#[derive(Debug, Clone)]
pub struct TurnSolution {
    /// One a pixel under the mask.
    pub(crate) fits: Vec<PixelFit>,
    /// The albedo of each pixel: in known light that of its fit where its normal is to be trusted.
    pub(crate) albedo: Vec<[f64; 3]>,
    /// The angle that each normal is expected to be off, radians.
    pub(crate) expected_errors: Vec<f64>,
    pub(crate) model: ShadingModel,
    pub(crate) elevation: Elevation,
    /// The light, where it was measured.
    pub(crate) measured: Option<ShLight>,
    pub(crate) conditioning: Conditioning,
    /// `None` if the object has none.
    pub(crate) gloss: Option<EstimatedGloss>,
}

/// Specular reflectance and smoothness of the whole object, as the render layers take them; of metal of an albedo of 1.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct EstimatedGloss {
    pub(crate) reflectance: f32,
    pub(crate) smoothness: f32,
}

impl EstimatedGloss {
    /// Of a surface that faces the viewer and reflects this part of even light.
    pub(crate) fn new(part: f64, smoothness: f64) -> Self {
        let smoothness = smoothness as f32;
        Self {
            reflectance: mirror_reflectance(part as f32, smoothness),
            smoothness,
        }
    }
}

impl TurnSolution {
    /// The normals in the viewer's frame.
    pub fn normals(&self, curves: &TurnCurves) -> Normals<YUp> {
        Normals::new(curves.map(|pixel| self.fits[pixel].normal.map(|v| v as f32)))
    }

    /// The albedo: in the light's units where that was known, else in such units that the mean shading of the object
    /// over the turn is 1 in each channel. In known light it is that of the same colour around where a normal is hardly to be
    /// trusted; in unknown light, what networks answer.
    pub fn albedo(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| self.albedo[pixel].map(|v| v as f32)))
    }

    /// The shading over the whole turn: the mean irradiance of each pixel, or what white metal would show.
    pub fn shading(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| {
            let harmonics = self.model.harmonics(self.fits[pixel].normal);
            harmonics.base.map(|harmonics| harmonics[0].max(0.0) as f32)
        }))
    }

    /// The confidence in each normal, 0 to 1: one half at an expected error of 11.5 degrees.
    pub fn confidence(&self, curves: &TurnCurves) -> Planes<1> {
        curves.map(|pixel| [confidence(self.expected_errors[pixel]) as f32])
    }

    /// The angle that each normal is expected to be off, degrees; 0 outside the mask.
    pub fn expected_errors(&self, curves: &TurnCurves) -> Planes<1> {
        curves.map(|pixel| [self.expected_errors[pixel].to_degrees() as f32])
    }

    /// The light to order 2, in the viewer's frame at the table's angle 0.
    ///
    /// # Errors
    /// If a term is not finite.
    pub fn light(&self) -> Result<ShLight, LightError> {
        let light = match &self.measured {
            Some(measured) => measured.clone(),
            None => self.model.light()?,
        };
        Ok(light.with_order(Order::TWO))
    }

    /// The object's assumed material.
    pub const fn material(&self) -> MaterialKind {
        self.model.material
    }

    /// The verdict on the normals and the albedo.
    pub const fn verdict(&self) -> TurnVerdict {
        self.conditioning.verdict
    }

    /// The median over the pixels of the residual of a curve, over the energy of its variation.
    pub fn residual(&self) -> f64 {
        median(self.fits.iter().map(|fit| fit.residual)).unwrap_or(0.0)
    }

    /// The median over the pixels of the angle that a normal is expected to be off, degrees.
    pub fn expected_error_deg(&self) -> f64 {
        median(self.expected_errors.iter().copied())
            .unwrap_or(0.0)
            .to_degrees()
    }
}

pub(crate) fn confidence(expected_error: f64) -> f64 {
    1.0 / (1.0 + (expected_error / HALF_ERROR).powi(2))
}
