//! What a pixel shows of the environment light.

use relight_core::light::{LightError, ShLight};

use crate::model::directions::reflected;
use crate::model::frame::TableFrame;
use crate::model::harmonics::COEFFICIENTS;
use crate::model::lighting::{MIRROR, TableLight, terms_along};
use crate::model::material::MaterialKind;

/// What a pixel shows of its base layer, channel by channel, at an albedo of 1.
pub(crate) type PixelHarmonics = [[f64; COEFFICIENTS]; 3];

/// The shading model: environment light and material, as a pixel shows them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShadingModel {
    pub(crate) frame: TableFrame,
    /// What a white surface shows: a diffuse one along its normal, metal along what it reflects.
    pub(crate) shown: TableLight,
    pub(crate) material: MaterialKind,
}

impl ShadingModel {
    /// That of a light in the viewer's frame, at the table's angle 0.
    pub(crate) fn in_light(light: &ShLight, frame: TableFrame, material: MaterialKind) -> Self {
        let light = TableLight::from_light(&light.rotated(&frame.rotation()));
        Self {
            frame,
            shown: match material {
                MaterialKind::Diffuse => light.irradiance(),
                MaterialKind::Metal => light.scaled(|_, _| MIRROR),
            },
            material,
        }
    }

    /// The direction of the table's frame that a normal of the viewer's shows.
    pub(crate) fn seen_along(&self, normal: [f64; 3]) -> [f64; 3] {
        self.frame.to_table(match self.material {
            MaterialKind::Diffuse => normal,
            MaterialKind::Metal => reflected(normal),
        })
    }

    /// The harmonics of a normal in the viewer's frame.
    pub(crate) fn harmonics(&self, normal: [f64; 3]) -> PixelHarmonics {
        self.shown.harmonics(&terms_along(self.seen_along(normal)))
    }

    /// The light in the viewer's frame, at the table's angle 0, as far as it is seen in the base layer.
    ///
    /// # Errors
    /// If a term is not finite.
    pub(crate) fn light(&self) -> Result<ShLight, LightError> {
        let light = match self.material {
            MaterialKind::Diffuse => self.shown.light_of_irradiance(),
            MaterialKind::Metal => self.shown.scaled(|_, _| 1.0 / MIRROR),
        };
        Ok(light.light()?.rotated(&self.frame.rotation().inverse()))
    }
}
