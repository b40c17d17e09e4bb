//! The gloss of a solved object, as the render layers take it, and the object as a file.

use std::f64::consts::FRAC_PI_2;

use super::light::basis_at;
use super::robust::lit;
use super::start::blurred;
use super::{ReadTurn, TurnCurves, TurnError, TurnSolution};
use crate::asset::Asset;
use crate::decompose::{FittedGloss, fit_gloss};
use crate::image::{Planes, Rgb, beside};
use crate::light::{Direction, Normals, Rotation, ShLight};
use crate::render::{Gloss, Surface};

/// Angles of the table at which the gloss is looked at: all that lies between shows nothing new.
const ANGLES: [f64; 4] = [0.0, FRAC_PI_2, 2.0 * FRAC_PI_2, 3.0 * FRAC_PI_2];
/// How far the coverage of a pixel reaches beyond the edge of the mask, pixels.
const EDGE: f64 = 0.6;

impl TurnSolution {
    /// The light in the viewer's frame when the table stands at an angle, radians.
    ///
    /// # Errors
    /// Where a term is not finite.
    pub fn light_at(&self, angle: f64) -> Result<ShLight, TurnError> {
        let light = self.light().to_viewer(self.frame())?;
        let [x, y, z] = self.frame().axis();
        let axis = Direction::new(x, y, z);
        Ok(axis.map_or(light.clone(), |axis| {
            light.rotated(&Rotation::about(axis, -angle))
        }))
    }

    /// The object as the render layers take it, with the gloss of [`TurnSolution::gloss`].
    ///
    /// # Errors
    /// None for maps of one size.
    pub fn surface(&self, curves: &TurnCurves) -> Result<Surface, TurnError> {
        let extent = curves.extent();
        let gloss = self
            .gloss(curves)?
            .map(|gloss| Gloss::even(extent, [gloss.reflectance; 3], gloss.smoothness));
        Ok(Surface::new(
            self.normals(curves),
            self.albedo(curves),
            gloss,
        )?)
    }

    /// Specular reflectance and smoothness of the whole object: those whose highlight in the light is nearest to the gloss
    /// that was found. None for a matt object.
    ///
    /// # Errors
    /// Where a term of the light is not finite.
    pub fn gloss(&self, curves: &TurnCurves) -> Result<Option<FittedGloss>, TurnError> {
        if self.room.gloss.is_none() {
            return Ok(None);
        }
        let normals = self.normals(curves);
        let mut best: Option<FittedGloss> = None;
        for angle in ANGLES {
            let basis = basis_at(angle);
            let highlight = curves.map(|pixel| {
                let [_, gloss] = lit(&self.room, self.fits[pixel].normal, &basis);
                [(gloss.iter().sum::<f64>() / 3.0).max(0.0) as f32]
            });
            let found = fit_gloss(&self.light_at(angle)?, &normals, &highlight)?;
            if found.is_some_and(|found| best.is_none_or(|best| found.residual < best.residual)) {
                best = found;
            }
        }
        Ok(best)
    }

    /// The object as a file that can be lit. Pixels at the edge of the mask, which show some of the background, get colour
    /// and normal of the nearest pixel inside.
    ///
    /// # Errors
    /// Where the maps are too large for a file.
    pub fn asset(&self, turn: &ReadTurn) -> Result<Asset, TurnError> {
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
        Ok(Asset::new(turn.name.clone(), surface, alpha, confidence)?)
    }
}

/// The part of each pixel under the mask, were its edge as soft as a lens makes it; what is hardly anything is nothing.
fn blurred_mask(mask: &Planes<1>, deviation: f64) -> Planes<1> {
    let everywhere = vec![true; mask.extent().pixels()];
    blurred(mask, &everywhere, deviation).map(|alpha| if alpha < 0.02 { 0.0 } else { alpha })
}
