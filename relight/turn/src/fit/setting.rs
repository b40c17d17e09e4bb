//! What is known of a turn's room.

use crate::fit::unknowns::Unknowns;
use crate::model::frame::TableFrame;
use crate::model::harmonics::GLOSS_ORDER;
use crate::model::known_light::KnownLight;
use crate::model::material::BodyKind;
use crate::model::shading::Room;

/// Bands of the room's light that gloss is fitted with, of order 0 and up.
pub(crate) const GLOSS_BANDS: usize = GLOSS_ORDER + 1;

/// What is known of a turn's room.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Setting {
    pub(crate) frame: TableFrame,
    pub(crate) known: Option<KnownLight>,
    /// Whether more is known of the shape than its outline.
    pub(crate) has_shape: bool,
}

impl Setting {
    /// What is to be found of the room of such an object. Where nothing is known of the shape but its outline, light and gloss
    /// together could explain any shape: a diffuse object is taken for one without gloss.
    pub(crate) fn unknowns(&self, body: BodyKind) -> Unknowns<'_> {
        let bands = if self.has_shape { GLOSS_BANDS } else { 0 };
        match (body, &self.known) {
            (BodyKind::Diffuse, Some(known)) => Unknowns::Gloss(known),
            (BodyKind::Diffuse, None) => Unknowns::Light { bands },
            (BodyKind::Metal, Some(known)) => Unknowns::Mirror(known),
            (BodyKind::Metal, None) => Unknowns::Reflection,
        }
    }

    /// What is still to be found of a room.
    pub(crate) fn unknowns_of(&self, room: &Room) -> Unknowns<'_> {
        match self.unknowns(room.body) {
            Unknowns::Light { .. } if room.gloss.is_none() => Unknowns::Light { bands: 0 },
            unknowns => unknowns,
        }
    }
}
