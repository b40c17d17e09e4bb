//! The gloss of a solved object, as the render layers take it, and the object as a file.

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Extent, Planes, Rgb, beside};
use relight_core::light::Normals;
use relight_core::render::{Gloss, Surface};

use crate::error::TurnError;
use crate::fit::solution::TurnSolution;
use crate::model::material::MaterialKind;
use crate::observe::curves::TurnCurves;
use crate::observe::reading::ReadTurn;

/// What a pixel beside another one contributes to its coverage, over the pixel itself. By hand: a deviation of 0.6 pixels.
const EDGE: f32 = 0.25;
/// Coverage below which a pixel is not part of the object, 0 to 1. By hand.
const MIN_ALPHA: f32 = 0.02;

impl TurnSolution {
    /// The object as the render layers take it, with its gloss. Metal is black with a gloss
    /// of its own colour.
    ///
    /// # Errors
    /// None for maps of one size.
    pub fn surface(&self, curves: &TurnCurves) -> Result<Surface, TurnError> {
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
    /// If the maps are too large for a file.
    pub(crate) fn captured_object(&self, turn: &ReadTurn) -> Result<CapturedObject, TurnError> {
        let curves = &turn.curves;
        let extent = curves.extent();
        let mask = curves.mask();
        let alpha = softened(&turn.mask);
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
fn softened(mask: &Planes<1>) -> Planes<1> {
    let Extent { width, height } = mask.extent();
    let near = |at: usize, size: usize| {
        let places = [
            (at.checked_sub(1), EDGE),
            (Some(at), 1.0),
            (Some(at + 1), EDGE),
        ];
        let places = places.into_iter();
        places.filter_map(move |(at, weight)| Some((at.filter(|&at| at < size)?, weight)))
    };
    Planes::from_fn(mask.extent(), |x, y| {
        let (mut sum, mut weights) = (0.0, 0.0);
        for (row, down) in near(y, height) {
            for (column, across) in near(x, width) {
                sum += down * across * mask.pixel(column, row)[0];
                weights += down * across;
            }
        }
        let alpha = sum / weights;
        [if alpha < MIN_ALPHA { 0.0 } else { alpha }]
    })
}

#[cfg(test)]
mod tests;
