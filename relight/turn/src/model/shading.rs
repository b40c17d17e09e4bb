//! What a pixel shows of the environment light.

use relight_core::light::{LightError, ShLight};

use crate::model::directions::reflected;
use crate::model::frame::TableFrame;
use crate::model::harmonics::COEFFICIENTS;
use crate::model::lighting::{MIRROR, TableLight, gloss_terms, terms_along};
use crate::model::material::MaterialKind;

/// The shading model: environment light and material, as a pixel shows them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShadingModel {
    pub(crate) frame: TableFrame,
    /// What a white diffuse surface shows along its normal; metal does not show it.
    pub(crate) diffuse: TableLight,
    /// The glossy part besides the diffuse one; for metal, that of a white one.
    pub(crate) gloss: TableLight,
    pub(crate) material: MaterialKind,
}

/// The harmonics of a base layer of albedo 1, and those that gloss adds whatever the albedo is, for each channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelHarmonics {
    pub(crate) base: [[f64; COEFFICIENTS]; 3],
    pub(crate) gloss: [[f64; COEFFICIENTS]; 3],
}

impl ShadingModel {
    /// The harmonics of a normal in the viewer's frame.
    pub(crate) fn harmonics(&self, normal: [f64; 3]) -> PixelHarmonics {
        let reflected = self.frame.to_table(reflected(normal));
        let none = [[0.0; COEFFICIENTS]; 3];
        match self.material {
            MaterialKind::Diffuse => PixelHarmonics {
                base: (self.diffuse).harmonics(&terms_along(self.frame.to_table(normal))),
                gloss: if self.gloss.is_none() {
                    none
                } else {
                    self.gloss.harmonics(&gloss_terms(normal[2], reflected))
                },
            },
            MaterialKind::Metal => PixelHarmonics {
                base: self.gloss.harmonics(&terms_along(reflected)),
                gloss: none,
            },
        }
    }

    /// The light in the viewer's frame, at the table's angle 0, as far as it is seen in the base layer.
    ///
    /// # Errors
    /// If a term is not finite.
    pub(crate) fn light(&self) -> Result<ShLight, LightError> {
        let light = match self.material {
            MaterialKind::Diffuse => self.diffuse.light_of_irradiance(),
            MaterialKind::Metal => self.gloss.scaled(|_, _| 1.0 / MIRROR),
        };
        Ok(light.light()?.rotated(&self.frame.rotation().inverse()))
    }
}
