//! Pictures to PNG, in memory.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{GrayImage, RgbImage};

use super::Error;

/// A grey PNG of few levels: unfiltered, as suits flat areas.
pub fn grey_png(image: &GrayImage, what: &'static str) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::NoFilter);
    image
        .write_with_encoder(encoder)
        .map_err(|source| Error::Encode { what, source })?;
    Ok(bytes)
}

/// A colour PNG, quickly.
pub fn rgb_png(image: &RgbImage, what: &'static str) -> Result<Vec<u8>, Error> {
    let mut bytes = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    image
        .write_with_encoder(encoder)
        .map_err(|source| Error::Encode { what, source })?;
    Ok(bytes)
}
