//! The page of a turn.

use image::imageops::{FilterType, resize};
use relit_data::image_stats::{SATURATION_LEVEL, SPEC_NET_GATE};
use relit_data::report::{self, Page, THUMBNAIL_SIDE, Thumbnail};
use relit_data::shard::{FrameRecord, Sample};

use super::simulated::SimulatedTurn;
use crate::SynthError;

/// Thumbnails on a page.
const THUMBNAILS: u32 = 24;

/// What the page of a turn shows.
pub(super) struct TurnPage {
    every: u32,
    pub(super) records: Vec<FrameRecord>,
    thumbnails: Vec<Thumbnail>,
}

impl TurnPage {
    pub(super) fn new(frames: u32) -> Self {
        Self {
            every: frames.div_ceil(THUMBNAILS),
            records: Vec::new(),
            thumbnails: Vec::new(),
        }
    }

    pub(super) fn keep(&mut self, sample: &Sample) {
        let index = sample.record.index;
        self.records.push(sample.record.clone());
        if !index.is_multiple_of(self.every) {
            return;
        }
        let side = sample.image.width().min(THUMBNAIL_SIDE);
        let image = resize(&sample.image, side, side, FilterType::Triangle);
        self.thumbnails.push(Thumbnail { index, image });
    }

    pub(super) fn render(&self, turn: &SimulatedTurn<'_>) -> Result<String, SynthError> {
        let pair = |name: &str, value: String| (name.to_owned(), value);
        let description = &turn.description;
        let facts = [
            pair("source", "simulated by relight synth".to_owned()),
            pair("seed", description.seed.to_string()),
            pair(
                "light",
                description
                    .panorama
                    .clone()
                    .unwrap_or_else(|| "lamps".to_owned()),
            ),
        ];
        let settings = [
            pair("frames", description.frames.to_string()),
            pair("size", description.size.to_string()),
        ];
        Ok(report::render(&Page {
            records: &self.records,
            thumbnails: &self.thumbnails,
            settings: &settings,
            facts: &facts,
            warnings: &[],
            quality: None,
            gate: SPEC_NET_GATE,
            saturation_level: SATURATION_LEVEL,
        })?)
    }
}
