//! The contact sheet: thumbnails over the turn, embedded in the page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageEncoder as _, RgbImage};

use super::axis::{degrees, percent};
use super::turn::Turn;
use super::{Page, THUMBNAIL_SIDE, Thumbnail};
use crate::shard::record::FrameRecord;

/// Good enough to judge mask and light; a quarter of a PNG's size on a real frame.
const JPEG_QUALITY: u8 = 85;

/// The thumbnails as figures, in the given order.
pub(super) fn sheet(page: &Page<'_>, turn: &Turn) -> Result<String, String> {
    page.thumbnails
        .iter()
        .map(|thumbnail| figure(page.records, turn, thumbnail))
        .collect()
}

fn figure(records: &[FrameRecord], turn: &Turn, thumbnail: &Thumbnail) -> Result<String, String> {
    let unknown = || format!("sample {} has a thumbnail and no record", thumbnail.index);
    let position = records
        .binary_search_by_key(&thumbnail.index, |r| r.index)
        .map_err(|_| unknown())?;
    let record = records.get(position).ok_or_else(unknown)?;
    let angle = turn
        .degrees
        .get(position)
        .copied()
        .map(degrees)
        .unwrap_or_default();
    let class = if record.spec_net { "frame on" } else { "frame" };
    Ok(format!(
        "<figure class=\"{class}\"><img src=\"{uri}\" width=\"{width}\" height=\"{height}\" \
         alt=\"Sample {index} at {angle}, {saturated} saturated\">\
         <figcaption><b>{angle}</b> <span>{index}</span>{marks}</figcaption></figure>\n",
        uri = data_uri(thumbnail)?,
        width = thumbnail.image.width(),
        height = thumbnail.image.height(),
        index = record.index,
        saturated = percent(record.saturated_fraction),
        marks = marks(record),
    ))
}

fn marks(record: &FrameRecord) -> String {
    let spec_net = if record.spec_net {
        "<i class=\"mark\">Spec-Net</i>"
    } else {
        ""
    };
    let duplicate = if record.duplicate {
        "<i class=\"mark again\">duplicate</i>"
    } else {
        ""
    };
    format!("{spec_net}{duplicate}")
}

/// The image as JPEG or PNG, whichever is smaller: PNG is smaller for small and flat images.
fn data_uri(thumbnail: &Thumbnail) -> Result<String, String> {
    let (index, image) = (thumbnail.index, &thumbnail.image);
    let (width, height) = image.dimensions();
    let fits = |side| (1..=THUMBNAIL_SIDE).contains(&side);
    if !fits(width) || !fits(height) {
        return Err(format!(
            "the thumbnail of sample {index} is {width} x {height} pixels"
        ));
    }
    let failed = |error| format!("the thumbnail of sample {index} could not be encoded: {error}");
    let jpeg = jpeg(image).map_err(failed)?;
    let png = png(image).map_err(failed)?;
    Ok(if jpeg.len() < png.len() {
        format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg))
    } else {
        format!("data:image/png;base64,{}", STANDARD.encode(png))
    })
}

fn jpeg(image: &RgbImage) -> Result<Vec<u8>, image::ImageError> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode_image(image)?;
    Ok(bytes)
}

fn png(image: &RgbImage) -> Result<Vec<u8>, image::ImageError> {
    let mut bytes = Vec::new();
    let (width, height) = image.dimensions();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive)
        .write_image(
            image.as_raw(),
            width,
            height,
            image::ExtendedColorType::Rgb8,
        )?;
    Ok(bytes)
}
