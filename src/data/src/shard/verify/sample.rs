//! Checks the parts of one sample. Knows bytes and pixels, and no files.

use std::sync::Arc;

use image::RgbImage;

use super::records::difference;
use crate::causes::with_causes;
use crate::image_stats::{MaskSpans, Measures};
use crate::shard::codec::{check_mask, decode_mask, decode_rgb};
use crate::shard::digest::Digest;
use crate::shard::parquet_table::TableRow;
use crate::shard::record::FrameRecord;
use crate::shard::settings::{ExtractionSettings, ImageSize};

/// The mask of a session, which all its samples share. It is decoded once.
#[derive(Default)]
pub(super) struct SessionMask {
    valid: Option<(Digest, Arc<MaskSpans>)>,
}

impl SessionMask {
    /// The mask, if a valid one was found.
    pub(super) fn get(&self) -> Option<Arc<MaskSpans>> {
        self.valid.as_ref().map(|(_, spans)| Arc::clone(spans))
    }

    /// The problems with the bytes of a mask, whose digest in the table is `expected`. The first
    /// valid mask becomes the session's.
    pub(super) fn check(&mut self, png: &[u8], expected: Option<&Digest>) -> Vec<String> {
        let digest = Digest::hash(png);
        let mut problems = wrong_digest("mask", &digest, expected);
        if self
            .valid
            .as_ref()
            .is_some_and(|(known, _)| *known == digest)
        {
            return problems;
        }
        if self.valid.is_some() && problems.is_empty() {
            problems.push("the mask differs from that of the session's other samples".to_owned());
        }
        match decode_mask(png)
            .and_then(|mask| check_mask(&mask).map(|()| MaskSpans::from_mask(&mask)))
        {
            Ok(spans) if problems.is_empty() => self.valid = Some((digest, Arc::new(spans))),
            Ok(_) => {}
            Err(error) => problems.push(format!("mask: {}", with_causes(&error))),
        }
        problems
    }
}

/// The problems with an image, and the image if it could be decoded. `row` is its row of the table,
/// `record` its record from the table or the shard.
pub(super) fn check_image(
    settings: &ExtractionSettings,
    png: &[u8],
    digest: &Digest,
    row: Option<&TableRow>,
    record: Option<&FrameRecord>,
    mask: Option<&MaskSpans>,
) -> (Vec<String>, Option<RgbImage>) {
    let mut problems = wrong_digest("image", digest, row.map(|row| &row.png_blake3));
    let image = match decode_rgb(png) {
        Ok(image) => image,
        Err(error) => {
            problems.push(format!("image: {}", with_causes(&error)));
            return (problems, None);
        }
    };
    let size = [image.width(), image.height()];
    if let Some(record) = record.filter(|record| record.size != size) {
        problems.push(format!(
            "the image is {size:?} pixels, its record says {:?}",
            record.size
        ));
    }
    if let Some(mask) = mask {
        if mask.size() == size {
            problems.extend(check_pixels(settings, &image, record, mask));
        } else {
            problems.push(format!(
                "the image is {size:?} pixels, its mask {:?}",
                mask.size()
            ));
        }
    }
    (problems, Some(image))
}

fn check_pixels(
    settings: &ExtractionSettings,
    image: &RgbImage,
    record: Option<&FrameRecord>,
    mask: &MaskSpans,
) -> Vec<String> {
    let mut problems = Vec::new();
    match mask.first_lit_outside(image) {
        Ok(None) => {}
        Ok(Some((x, y))) => problems.push(format!("pixel ({x}, {y}) outside the mask is not 0")),
        Err(error) => problems.push(with_causes(&error)),
    }
    // Scaled or shifted pixels differ from those that were measured.
    let has_source_pixels = |record: &&FrameRecord| {
        settings.size == ImageSize::NATIVE
            && !record.shift_applied
            && [record.crop.w, record.crop.h] == mask.size()
    };
    let Some(record) = record.filter(has_source_pixels) else {
        return problems;
    };
    match mask.measure(image, settings.saturation_level) {
        Ok(measures) => problems.extend(check_measures(record, &measures)),
        Err(error) => problems.push(with_causes(&error)),
    }
    problems
}

fn check_measures(record: &FrameRecord, found: &Measures) -> Vec<String> {
    let counts = [
        ("mask_px", record.mask_px, found.mask_px),
        ("saturated_px", record.saturated_px, found.saturated_px),
        (
            "saturated_any_px",
            record.saturated_any_px,
            found.saturated_any_px,
        ),
    ];
    let mut problems: Vec<String> = counts
        .into_iter()
        .filter(|(_, recorded, found)| recorded != found)
        .map(|(name, recorded, found)| format!("{name} is {recorded}, the pixels give {found}"))
        .collect();
    if record.mean_rgb != found.mean_rgb {
        let (recorded, found) = (record.mean_rgb, found.mean_rgb);
        problems.push(format!(
            "mean_rgb is {recorded:?}, the pixels give {found:?}"
        ));
    }
    if record.sharpness != found.sharpness {
        let (recorded, found) = (record.sharpness, found.sharpness);
        problems.push(format!("sharpness is {recorded}, the pixels give {found}"));
    }
    problems
}

/// The problems with the bytes of a record, and the record if it could be read.
pub(super) fn check_record(
    json: &[u8],
    row: Option<&TableRow>,
) -> (Vec<String>, Option<FrameRecord>) {
    let record: FrameRecord = match serde_json::from_slice(json) {
        Ok(record) => record,
        Err(error) => return (vec![format!("record: {error}")], None),
    };
    let mut problems = Vec::new();
    if let Some(row) = row {
        let fields = difference(&record, &row.record);
        if !fields.is_empty() {
            problems.push(format!(
                "the record differs from the table in {}",
                fields.join(", ")
            ));
        } else if serde_json::to_vec(&row.record).ok().as_deref() != Some(json) {
            problems.push("the record's JSON differs from what was written".to_owned());
        }
    }
    (problems, Some(record))
}

fn wrong_digest(part: &str, digest: &Digest, expected: Option<&Digest>) -> Vec<String> {
    expected
        .filter(|&expected| expected != digest)
        .map(|_| format!("the BLAKE3 of the {part} differs from the table's"))
        .into_iter()
        .collect()
}
