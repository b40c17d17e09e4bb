//! Images to PNG, in memory.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{GrayImage, RgbImage};

use super::MaskError;

/// A grey image as PNG, without filters: best for flat areas. `what` names the image in the error.
///
/// # Errors
/// [`MaskError::Encode`].
pub fn grey_png(image: &GrayImage, what: &'static str) -> Result<Vec<u8>, MaskError> {
    let mut bytes = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::NoFilter);
    image
        .write_with_encoder(encoder)
        .map_err(|source| MaskError::Encode { what, source })?;
    Ok(bytes)
}

/// A colour image as PNG, with fast compression. `what` names the image in the error.
///
/// # Errors
/// [`MaskError::Encode`].
pub fn rgb_png(image: &RgbImage, what: &'static str) -> Result<Vec<u8>, MaskError> {
    let mut bytes = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    image
        .write_with_encoder(encoder)
        .map_err(|source| MaskError::Encode { what, source })?;
    Ok(bytes)
}
