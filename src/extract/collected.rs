//! What is kept in memory of a session's samples, for its report.

use image::RgbImage;
use image::imageops::thumbnail;

use relit_data::report::{THUMBNAIL_SIDE, Thumbnail};
use relit_data::shard::{FrameRecord, TurnFinding};

/// Images on the report's contact sheet.
const THUMBNAILS: u32 = 24;

/// The records of all samples, and small images of a few.
pub(super) struct Collected {
    samples: u32,
    pub(super) records: Vec<FrameRecord>,
    pub(super) thumbnails: Vec<Thumbnail>,
}

impl Collected {
    pub(super) fn new(samples: u32) -> Self {
        Self {
            samples,
            records: Vec::new(),
            thumbnails: Vec::new(),
        }
    }

    /// Adds a sample; the order is free.
    pub(super) fn add(&mut self, record: &FrameRecord, image: &RgbImage) {
        if self.is_thumbnail(record.index) {
            let image = small(image);
            self.thumbnails.push(Thumbnail {
                index: record.index,
                image,
            });
        }
        self.records.push(record.clone());
    }

    /// Sorts everything by index.
    pub(super) fn sorted(mut self) -> Self {
        self.records.sort_by_key(|record| record.index);
        self.thumbnails.sort_by_key(|thumbnail| thumbnail.index);
        self
    }

    /// Completes the record of a sample, after sorting, by what only the whole turn shows.
    pub(super) fn complete(&mut self, found: &TurnFinding) {
        if let Some(record) = self.records.get_mut(found.index as usize) {
            record.exposure_step = found.exposure_step;
            record.identical_to = found.identical_to;
            record.blur = found.blur;
        }
    }

    /// Number of records for which `is` is true.
    pub(super) fn count(&self, is: fn(&FrameRecord) -> bool) -> u32 {
        self.records.iter().filter(|record| is(record)).count() as u32
    }

    /// Whether a sample is on the contact sheet, whose samples are evenly spread.
    fn is_thumbnail(&self, index: u32) -> bool {
        let slot = |index: u32| u64::from(index) * u64::from(THUMBNAILS) / u64::from(self.samples);
        index == 0 || slot(index) != slot(index - 1)
    }
}

fn small(image: &RgbImage) -> RgbImage {
    let (width, height) = image.dimensions();
    if width.max(height) <= THUMBNAIL_SIDE {
        return image.clone();
    }
    // Crops are square.
    thumbnail(image, THUMBNAIL_SIDE, THUMBNAIL_SIDE)
}
