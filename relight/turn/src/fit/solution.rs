//! Normals, albedo and light of a solved turn.

use relight_core::image::{Linear, Planes, Rgb};
use relight_core::light::{LightError, Normals, Order, ShLight};
use relit_data::statistics::median;

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
    /// One a pixel under the mask, in the viewer's frame.
    pub(crate) normals: Vec<[f64; 3]>,
    /// The albedo of each pixel.
    pub(crate) albedo: Vec<[f64; 3]>,
    /// The angle that each normal is expected to be off, radians.
    pub(crate) expected_errors: Vec<f64>,
    pub(crate) model: ShadingModel,
    pub(crate) elevation: Elevation,
    /// The light, where it was measured.
    pub(crate) measured: Option<ShLight>,
    pub(crate) conditioning: Conditioning,
    /// The median over the pixels of the residual of a curve, over the energy of its variation.
    pub(crate) residual: f64,
}

impl TurnSolution {
    /// The normals in the viewer's frame.
    pub fn normals(&self, curves: &TurnCurves) -> Normals {
        Normals::new(curves.map(|pixel| self.normals[pixel].map(|v| v as f32)))
    }

    /// The albedo: in the light's units where that was known, else in such units that the mean shading of the object
    /// over the turn is 1 in each channel.
    pub fn albedo(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| self.albedo[pixel].map(|v| v as f32)))
    }

    /// The shading over the whole turn: the mean irradiance of each pixel, or what white metal would show.
    pub fn shading(&self, curves: &TurnCurves) -> Rgb<Linear> {
        Rgb::new(curves.map(|pixel| {
            let harmonics = self.model.harmonics(self.normals[pixel]);
            harmonics.map(|harmonics| harmonics[0].max(0.0) as f32)
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
    pub const fn residual(&self) -> f64 {
        self.residual
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
