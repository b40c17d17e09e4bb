//! What is kept of a session's samples for its table and its page.

use image::RgbImage;
use image::imageops::thumbnail;

use relit_data::report::{THUMBNAIL_SIDE, Thumbnail};
use relit_data::shard::FrameRecord;

/// Pictures on the report's contact sheet.
const THUMBNAILS: u32 = 24;

/// The records of all samples, and the pictures of a few.
pub(super) struct Made {
    samples: u32,
    pub(super) records: Vec<FrameRecord>,
    pub(super) thumbnails: Vec<Thumbnail>,
}

impl Made {
    pub(super) fn new(samples: u32) -> Self {
        Self {
            samples,
            records: Vec::new(),
            thumbnails: Vec::new(),
        }
    }

    /// Keeps what is needed of one sample; they come in no order.
    pub(super) fn keep(&mut self, record: &FrameRecord, image: &RgbImage) {
        if self.is_thumbnail(record.index) {
            let image = small(image);
            self.thumbnails.push(Thumbnail {
                index: record.index,
                image,
            });
        }
        self.records.push(record.clone());
    }

    /// Everything by index.
    pub(super) fn in_order(mut self) -> Self {
        self.records.sort_by_key(|record| record.index);
        self.thumbnails.sort_by_key(|thumbnail| thumbnail.index);
        self
    }

    /// How many records are of this kind.
    pub(super) fn count(&self, is: fn(&FrameRecord) -> bool) -> u32 {
        self.records.iter().filter(|record| is(record)).count() as u32
    }

    /// Whether a sample is one of the evenly spread ones on the contact sheet.
    fn is_thumbnail(&self, index: u32) -> bool {
        let place = |index: u32| u64::from(index) * u64::from(THUMBNAILS) / u64::from(self.samples);
        index == 0 || place(index) != place(index - 1)
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
