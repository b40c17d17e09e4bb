//! What a pixel shows of the environment light.

use crate::model::directions::reflected;
use crate::model::frame::TableFrame;
use crate::model::gloss::{GlossLight, mirror_terms};
use crate::model::harmonics::{COEFFICIENTS, LAMBERTIAN_COEFFICIENTS};
use crate::model::lighting::TableLight;
use crate::model::material::MaterialKind;

/// The shading model: environment light and material, as a pixel shows them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ShadingModel {
    pub(crate) frame: TableFrame,
    pub(crate) light: TableLight,
    /// What a diffuse surface shows of the bands beyond the second, as a mirror would show it along the normal; of a light
    /// that had to be found nothing is known of them.
    pub(crate) diffuse_beyond: GlossLight,
    /// What gloss shows of it beside the diffuse part; of metal, what a white one shows.
    pub(crate) gloss: GlossLight,
    pub(crate) material: MaterialKind,
}

/// The harmonics of a base layer of albedo 1, and those that gloss adds whatever the albedo is, for each channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelHarmonics {
    pub(crate) base: [[f64; COEFFICIENTS]; 3],
    /// How many harmonics of the base layer there are: the others are 0.
    pub(crate) count: usize,
    pub(crate) gloss: [[f64; COEFFICIENTS]; 3],
}

impl ShadingModel {
    /// The harmonics of a normal in the viewer's frame.
    pub(crate) fn harmonics(&self, normal: [f64; 3]) -> PixelHarmonics {
        let reflected = self.frame.to_table(reflected(normal));
        match self.material {
            MaterialKind::Diffuse => {
                let (base, count) = self.diffuse(self.frame.to_table(normal));
                PixelHarmonics {
                    base,
                    count,
                    gloss: self.gloss.harmonics(normal[2], reflected),
                }
            }
            MaterialKind::Metal => PixelHarmonics {
                base: self.gloss.harmonics_of(&mirror_terms(reflected)),
                count: COEFFICIENTS,
                gloss: [[0.0; COEFFICIENTS]; 3],
            },
        }
    }

    /// The irradiance on a normal in the table's frame as harmonics, and how many of them there are.
    fn diffuse(&self, normal: [f64; 3]) -> ([[f64; COEFFICIENTS]; 3], usize) {
        let mut base = self.light.harmonics(normal);
        if self.diffuse_beyond.is_none() {
            return (base, LAMBERTIAN_COEFFICIENTS);
        }
        let beyond = self.diffuse_beyond.harmonics_of(&mirror_terms(normal));
        let pairs = base
            .as_flattened_mut()
            .iter_mut()
            .zip(beyond.as_flattened());
        pairs.for_each(|(sum, part)| *sum += part);
        (base, COEFFICIENTS)
    }
}
