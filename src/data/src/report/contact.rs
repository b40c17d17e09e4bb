//! The contact sheet: thumbnails over the turn, embedded in the page.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ImageEncoder as _, ImageError, RgbImage};

use super::Page;
use super::text::{degrees, percent};
use super::turn::Turn;
use crate::shard::record::FrameRecord;

/// Good enough to judge mask and light; a quarter of a PNG's size on a real frame.
const JPEG_QUALITY: u8 = 85;

/// The thumbnails as figures, in the given order.
pub(super) fn sheet(page: &Page<'_>, turn: &Turn) -> Result<String, ImageError> {
    let figures = page.thumbnails.iter().filter_map(|(index, image)| {
        let position = page.records.binary_search_by_key(index, |r| r.index);
        let position = position.ok()?;
        let angle = turn.degrees.get(position).copied();
        Some(figure(
            page.records.get(position)?,
            &angle.map(degrees).unwrap_or_default(),
            image,
        ))
    });
    figures.collect()
}

fn figure(record: &FrameRecord, angle: &str, image: &RgbImage) -> Result<String, ImageError> {
    let class = if record.spec_net { "frame on" } else { "frame" };
    Ok(format!(
        "<figure class=\"{class}\"><img src=\"{uri}\" width=\"{width}\" height=\"{height}\" \
         alt=\"Sample {index} at {angle}, {saturated} saturated\">\
         <figcaption><b>{angle}</b> <span>sample {index}</span>{marks}</figcaption></figure>\n",
        uri = data_uri(image)?,
        width = image.width(),
        height = image.height(),
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
fn data_uri(image: &RgbImage) -> Result<String, ImageError> {
    let (jpeg, png) = (jpeg(image)?, png(image)?);
    Ok(if jpeg.len() < png.len() {
        format!("data:image/jpeg;base64,{}", STANDARD.encode(jpeg))
    } else {
        format!("data:image/png;base64,{}", STANDARD.encode(png))
    })
}

fn jpeg(image: &RgbImage) -> Result<Vec<u8>, ImageError> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode_image(image)?;
    Ok(bytes)
}

fn png(image: &RgbImage) -> Result<Vec<u8>, ImageError> {
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
