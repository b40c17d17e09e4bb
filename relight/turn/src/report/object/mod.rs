//! A solved object as the render layers take it, and as a file.

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Extent, Planes, Rgb, beside};
use relight_core::light::Normals;
use relight_core::render::{Gloss, Surface, mirror_reflectance};

use crate::error::TurnError;
use crate::fit::smoothing::smoothed;
use crate::fit::solution::TurnSolution;
use crate::model::material::MaterialKind;
use crate::observe::curves::TurnCurves;
use crate::observe::reading::ReadTurn;

/// The standard deviation by which a mask is smoothed to find its outline, pixels. By hand: steps of some pixels vanish, and parts
/// of three pixels stay.
const OUTLINE: f32 = 1.5;
/// Smoothness (exponent of the lobe) of metal, which is not estimated. By convention.
const METAL_SMOOTHNESS: f32 = 60.0;
/// Coverage below which a pixel is not part of the object, 0 to 1. By hand.
const MIN_ALPHA: f32 = 0.02;

impl TurnSolution {
    /// The object as the render layers take it. Metal is black with a gloss of its own colour.
    ///
    /// # Errors
    /// None for maps of one size.
    pub fn surface(&self, curves: &TurnCurves) -> Result<Surface, TurnError> {
        let extent = curves.extent();
        let (normals, albedo) = (self.normals(curves), self.albedo(curves));
        Ok(match self.material() {
            MaterialKind::Metal => {
                let reflectance = mirror_reflectance(1.0, METAL_SMOOTHNESS);
                let colour = albedo.into_planes().map(|value| value * reflectance);
                let smoothness = Planes::filled(extent, [METAL_SMOOTHNESS]);
                let black = Rgb::new(Planes::zeros(extent));
                Surface::new(normals, black, Some(Gloss::new(colour, smoothness)?))?
            }
            MaterialKind::Diffuse => Surface::new(normals, albedo, None)?,
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
        let alpha = coverage(&turn.mask);
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

/// The part of each pixel that the object covers; what is hardly anything is nothing.
///
/// A mask that says it pixel by pixel is taken as it is. The outline of another is smoothed, so that it has no steps, and is one pixel
/// wide: alpha follows the distance from where the smoothed mask is one half. What is too thin for that keeps what is left of it.
fn coverage(mask: &Planes<1>) -> Planes<1> {
    let is_partly = |value: &&f32| (MIN_ALPHA..1.0 - MIN_ALPHA).contains(*value);
    let whole = |alpha: f32| if alpha < MIN_ALPHA { 0.0 } else { alpha };
    if mask.plane(0).iter().any(|value| is_partly(&value)) {
        return mask.clone().map(whole);
    }
    let Extent { width, height } = mask.extent();
    let smooth = smoothed(mask, OUTLINE);
    let at = |x: usize, y: usize| smooth.pixel(x, y)[0];
    Planes::from_fn(mask.extent(), |x, y| {
        let right = (x + 1).min(width - 1);
        let below = (y + 1).min(height - 1);
        let (left, above) = (x.saturating_sub(1), y.saturating_sub(1));
        let across = (at(right, y) - at(left, y)) / (right - left).max(1) as f32;
        let down = (at(x, below) - at(x, above)) / (below - above).max(1) as f32;
        let beyond = (at(x, y) - 0.5) / across.hypot(down).max(f32::MIN_POSITIVE);
        let thin = mask.pixel(x, y)[0] * at(x, y);
        [whole((0.5 + beyond).clamp(0.0, 1.0).max(thin))]
    })
}

#[cfg(test)]
mod tests;
