//! The gloss of a solved object, as the render layers take it, and the object as a file.

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Planes, Rgb, beside};
use relight_core::light::Normals;
use relight_core::render::{Gloss, Surface};

use crate::error::TurnError;
use crate::fit::smoothing::blurred;
use crate::fit::solution::TurnSolution;
use crate::model::material::MaterialKind;
use crate::observe::curves::TurnCurves;
use crate::observe::reading::ReadTurn;

/// Standard deviation of the coverage at the edge of the mask, pixels. By hand.
const EDGE: f64 = 0.6;
/// Coverage below which a pixel is not part of the object, 0 to 1. By hand.
const LEAST_ALPHA: f32 = 0.02;

impl TurnSolution {
    /// The object as the render layers take it, with its gloss. Metal is black with a gloss
    /// of its own colour.
    ///
    /// # Errors
    /// None for maps of one size.
    pub(crate) fn surface(&self, curves: &TurnCurves) -> Result<Surface, TurnError> {
        let extent = curves.extent();
        let (normals, albedo) = (self.normals(curves), self.albedo(curves));
        Ok(match (self.material(), self.gloss) {
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
