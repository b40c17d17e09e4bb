//! What is known of a turn's environment light.

use crate::fit::unknowns::Unknowns;
use crate::model::frame::TableFrame;
use crate::model::harmonics::GLOSS_ORDER;
use crate::model::known_light::KnownLight;
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;

/// Bands of the environment light that gloss is fitted with, of order 0 and up.
pub(crate) const GLOSS_BANDS: usize = GLOSS_ORDER + 1;

/// What is known of a turn's environment light beforehand.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Setting {
    pub(crate) frame: TableFrame,
    pub(crate) known: Option<KnownLight>,
    /// Whether more is known of the shape than its outline.
    pub(crate) has_shape: bool,
    /// Whether what is known of it says how far it is off: then nothing else initialises.
    pub(crate) has_errors: bool,
}

impl Setting {
    /// Whether the errors of the prior are what is known best: of a light that has to be found too.
    pub(crate) fn knows_errors_of_unknown_light(&self) -> bool {
        self.has_errors && self.known.is_none()
    }

    /// The unknowns of an object of such a material. Where nothing is known of the shape but its outline, light and
    /// gloss together could fit any shape: a diffuse object is taken for one without gloss.
    pub(crate) fn unknowns(&self, material: MaterialKind) -> Unknowns<'_> {
        let bands = if self.has_shape { GLOSS_BANDS } else { 0 };
        match (material, &self.known) {
            (MaterialKind::Diffuse, Some(known)) => Unknowns::Gloss(known),
            (MaterialKind::Diffuse, None) => Unknowns::Light { bands },
            (MaterialKind::Metal, Some(known)) => Unknowns::Mirror(known),
            (MaterialKind::Metal, None) => Unknowns::Reflection,
        }
    }

    /// The unknowns of a shading model that was fitted before.
    pub(crate) fn unknowns_of(&self, model: &ShadingModel) -> Unknowns<'_> {
        match self.unknowns(model.material) {
            Unknowns::Light { .. } if model.gloss.is_none() => Unknowns::Light { bands: 0 },
            unknowns => unknowns,
        }
    }
}
