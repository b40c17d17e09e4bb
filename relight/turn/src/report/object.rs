//! The gloss of a solved object, as the render layers take it, and the object as a file.

use std::f64::consts::FRAC_PI_2;

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Planes, Rgb, beside};
use relight_core::light::{Direction, Normals, Rotation, ShLight};
use relight_core::render::{Gloss, Surface};
use relight_photo::decompose::{FittedGloss, fit_gloss};

use crate::error::TurnError;
use crate::fit::residuals::lit;
use crate::fit::smoothing::blurred;
use crate::fit::solution::TurnSolution;
use crate::model::harmonics::basis_at;
use crate::model::material::MaterialKind;
use crate::observe::curves::TurnCurves;
use crate::observe::reading::ReadTurn;

/// Angles of the table at which the gloss is looked at: all that lies between shows nothing new.
const ANGLES: [f64; 4] = [0.0, FRAC_PI_2, 2.0 * FRAC_PI_2, 3.0 * FRAC_PI_2];

/// Smoothness (exponent of the lobe) of metal in unknown light, which no turn determines. By convention.
const METAL_SMOOTHNESS: f32 = 60.0;
/// Standard deviation of the coverage at the edge of the mask, pixels. By hand.
const EDGE: f64 = 0.6;
/// Coverage below which a pixel is not part of the object, 0 to 1. By hand.
const LEAST_ALPHA: f32 = 0.02;

impl TurnSolution {
    fn turned(&self, light: ShLight, angle: f64) -> ShLight {
        let [x, y, z] = self.frame().axis();
        let axis = Direction::new(x, y, z);
        axis.map_or(light.clone(), |axis| {
            light.rotated(&Rotation::about(axis, -angle))
        })
    }

    /// The object as the render layers take it, with the gloss of [`TurnSolution::gloss`]. Metal is black with a gloss
    /// of its own colour.
    ///
    /// # Errors
    /// None for maps of one size.
    pub(crate) fn surface(&self, curves: &TurnCurves) -> Result<Surface, TurnError> {
        let extent = curves.extent();
        let (normals, albedo) = (self.normals(curves), self.albedo(curves));
        let gloss = self.gloss(curves)?;
        Ok(match (self.material(), gloss) {
            (MaterialKind::Metal, Some(gloss)) => {
                let colour = albedo.into_planes().map(|value| value * gloss.reflectance);
                let smoothness = Planes::filled(extent, [gloss.smoothness]);
                let black = Rgb::new(Planes::zeros(extent));
                Surface::new(normals, black, Some(Gloss::new(colour, smoothness)?))?
            }
            (_, gloss) => {
                let gloss = gloss
                    .map(|gloss| Gloss::even(extent, [gloss.reflectance; 3], gloss.smoothness));
                Surface::new(normals, albedo, gloss)?
            }
        })
    }

    /// Specular reflectance and smoothness of the whole object: those whose highlight in the light is nearest to the
    /// gloss that was found. Of metal, the reflectance is that of an albedo of 1. None for an object without gloss, as a
    /// diffuse one in unknown light.
    ///
    /// # Errors
    /// Where a term of the light is not finite.
    pub(crate) fn gloss(&self, curves: &TurnCurves) -> Result<Option<FittedGloss>, TurnError> {
        if self.model.gloss.is_none() {
            return Ok(None);
        }
        let Some(measured) = &self.measured else {
            // What metal shows is all that is known of the light: it may be blurred or not.
            return Ok(Some(FittedGloss {
                reflectance: (METAL_SMOOTHNESS + 2.0) / 8.0,
                smoothness: METAL_SMOOTHNESS,
                residual: 1.0,
            }));
        };
        let normals = self.normals(curves);
        let mut best: Option<FittedGloss> = None;
        for angle in ANGLES {
            let basis = basis_at(angle);
            let highlight = curves.map(|pixel| {
                let [base, gloss] = lit(&self.model, self.fits[pixel].normal, &basis);
                let gloss = match self.material() {
                    MaterialKind::Diffuse => gloss,
                    MaterialKind::Metal => base,
                };
                [(gloss.iter().sum::<f64>() / 3.0).max(0.0) as f32]
            });
            let light = self.turned(measured.clone(), angle);
            let found = fit_gloss(&light, &normals, &highlight)?;
            if found.is_some_and(|found| best.is_none_or(|best| found.residual < best.residual)) {
                best = found;
            }
        }
        Ok(best)
    }

    /// The object as a file that can be lit. Pixels at the edge of the mask, which show some of the background, get
    /// colour and normal of the nearest pixel inside.
    ///
    /// # Errors
    /// Where the maps are too large for a file.
    pub(crate) fn captured_object(&self, turn: &ReadTurn) -> Result<CapturedObject, TurnError> {
        let curves = &turn.curves;
        let extent = curves.extent();
        let mask = curves.mask();
        let alpha = blurred_mask(&turn.mask, EDGE);
        let inner: Vec<bool> = (0..mask.len())
            .map(|at| {
                mask[at]
                    && beside(extent, at)
                        .into_iter()
                        .flatten()
                        .all(|other| mask[other])
            })
            .collect();
        let known = if inner.contains(&true) { inner } else { mask };
        let wanted: Vec<bool> = alpha.plane(0).iter().map(|&alpha| alpha > 0.0).collect();
        let surface = self.surface(curves)?;
        let normals = surface.normals().planes().clone().extended(&known, &wanted);
        let albedo = surface.albedo().planes().clone().extended(&known, &wanted);
        let gloss = surface.gloss().cloned();
        let surface = Surface::new(Normals::new(normals), Rgb::new(albedo), gloss)?;
        let confidence = self.confidence(curves);
        Ok(CapturedObject::new(
            turn.name.clone(),
            surface,
            alpha,
            confidence,
        )?)
    }
}

/// The part of each pixel under the mask, were its edge as soft as a lens makes it; what is hardly anything is nothing.
fn blurred_mask(mask: &Planes<1>, deviation: f64) -> Planes<1> {
    let everywhere = vec![true; mask.extent().pixels()];
    blurred(mask, &everywhere, deviation).map(|alpha| if alpha < LEAST_ALPHA { 0.0 } else { alpha })
}

#[cfg(test)]
mod tests;
