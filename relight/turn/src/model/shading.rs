//! What a pixel shows of the room.

use crate::model::directions::reflected;
use crate::model::frame::TableFrame;
use crate::model::gloss::GlossLight;
use crate::model::harmonics::{MATT_WAVES, WAVES};
use crate::model::lighting::TableLight;
use crate::model::material::BodyKind;
use crate::model::metal::mirror_terms;

/// The light of the room, as a pixel shows it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Room {
    pub(crate) frame: TableFrame,
    pub(crate) light: TableLight,
    /// What gloss shows of it beside the matt part; of metal, what a white one shows.
    pub(crate) gloss: GlossLight,
    pub(crate) body: BodyKind,
}

/// The waves of a body of albedo 1, and those that gloss adds whatever the albedo is, for each channel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelWaves {
    pub(crate) body: [[f64; WAVES]; 3],
    /// How many waves of the body there are: the others are 0.
    pub(crate) count: usize,
    pub(crate) gloss: [[f64; WAVES]; 3],
}

impl Room {
    /// The waves of a normal in the viewer's frame.
    pub(crate) fn waves(&self, normal: [f64; 3]) -> PixelWaves {
        let reflected = self.frame.to_table(reflected(normal));
        match self.body {
            BodyKind::Diffuse => PixelWaves {
                body: self.light.waves(self.frame.to_table(normal)),
                count: MATT_WAVES,
                gloss: self.gloss.waves(normal[2], reflected),
            },
            BodyKind::Metal => PixelWaves {
                body: self.gloss.waves_of(&mirror_terms(reflected)),
                count: WAVES,
                gloss: [[0.0; WAVES]; 3],
            },
        }
    }
}
