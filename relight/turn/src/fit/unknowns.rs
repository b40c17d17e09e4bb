//! The unknowns of a joint optimisation, and the derivative of a curve to each: how much an object's gloss, or metal,
//! shows of each band of a light that is known.

use crate::model::directions::reflected;
use crate::model::frame::TableFrame;
use crate::model::gloss::{GlossLight, gloss_terms, mirror_terms};
use crate::model::harmonics::COEFFICIENTS;
use crate::model::known_light::KnownLight;
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;

/// Largest attenuation of a band by gloss, over that of a smooth dielectric. By hand: light by a dark grey ball is
/// in small units.
const MOST_GLOSS: f64 = 20.0;
/// Largest attenuation of a band by metal, over that of band 0. By hand: physically 1.
const MOST_METAL: f64 = 1.2;
/// Least attenuation of band 0 by which the others of metal are divided. Numerical.
const LEAST_FIRST: f64 = 0.05;
/// What metal shows of band l at first: this to the power of l. By hand.
const FIRST_OF_METAL: f64 = 0.9;

/// The unknowns of an object of a material in a known light: the attenuation of each band.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Unknowns<'a> {
    pub(crate) frame: TableFrame,
    pub(crate) known: &'a KnownLight,
    pub(crate) material: MaterialKind,
}

impl Unknowns<'_> {
    /// The shading model that initialises a fit: without gloss, or of metal that is hardly rough.
    pub(crate) fn initial(&self) -> ShadingModel {
        let mirror = self.known.mirror();
        let attenuations: Vec<f64> = (0..mirror.len())
            .map(|l| FIRST_OF_METAL.powi(l as i32))
            .collect();
        let gloss = match self.material {
            MaterialKind::Diffuse => GlossLight::NONE,
            MaterialKind::Metal => GlossLight::sum(mirror, &attenuations),
        };
        self.with_gloss(gloss)
    }

    /// The attenuations of a shading model.
    pub(crate) fn estimate(&self, model: &ShadingModel) -> Vec<f64> {
        let attenuation = |band| model.gloss.attenuation_of(band);
        self.bands().iter().map(attenuation).collect()
    }

    /// The shading model of these attenuations.
    pub(crate) fn model(&self, attenuations: &[f64]) -> ShadingModel {
        self.with_gloss(GlossLight::sum(self.bands(), attenuations))
    }

    /// The attenuations after a step, within what they can be.
    pub(crate) fn moved(&self, attenuations: &[f64], step: &[f64]) -> Vec<f64> {
        let mut moved: Vec<f64> = attenuations
            .iter()
            .zip(step)
            .map(|(attenuation, by)| (attenuation + by).clamp(0.0, MOST_GLOSS))
            .collect();
        if let (MaterialKind::Metal, Some(&first)) = (self.material, moved.first()) {
            // Of an even light metal shows its albedo's part, whatever its lobe is.
            let first = first.max(LEAST_FIRST);
            for attenuation in &mut moved {
                *attenuation = (*attenuation / first).min(MOST_METAL);
            }
        }
        moved
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.bands().len()
    }

    /// The harmonics of a pixel for each unknown, channel by channel.
    pub(crate) fn columns(
        &self,
        normal: [f64; 3],
        albedo: [f64; 3],
    ) -> [Vec<(usize, [f64; COEFFICIENTS])>; 3] {
        let reflected = self.frame.to_table(reflected(normal));
        // What gloss shows does not depend on the albedo, and what metal shows is times it.
        let (gloss, colour) = match self.material {
            MaterialKind::Diffuse => (gloss_terms(normal[2], reflected), [1.0; 3]),
            MaterialKind::Metal => (mirror_terms(reflected), albedo),
        };
        let bands: Vec<_> = self
            .bands()
            .iter()
            .map(|band| band.harmonics_of(&gloss))
            .collect();
        [0, 1, 2].map(|channel| {
            let of_band = |harmonics: &[[f64; COEFFICIENTS]; 3]| {
                harmonics[channel].map(|coefficient| colour[channel] * coefficient)
            };
            bands.iter().map(of_band).enumerate().collect()
        })
    }

    /// What the object would show of each band of the light if it blurred nothing.
    fn bands(&self) -> &[GlossLight] {
        match self.material {
            MaterialKind::Diffuse => self.known.bands(),
            MaterialKind::Metal => self.known.mirror(),
        }
    }

    fn with_gloss(&self, gloss: GlossLight) -> ShadingModel {
        ShadingModel {
            frame: self.frame,
            light: self.known.diffuse,
            diffuse_beyond: self.known.diffuse_beyond,
            gloss,
            material: self.material,
        }
    }
}
