//! Images to PNG and back. The same pixels always give the same bytes.

use std::io::Cursor;

use image::{GrayImage, RgbImage};
use png::{BitDepth, ColorType, Compression};

use super::ShardError;

/// Largest image that is decoded, pixels: 64 Mi, 192 MiB of RGB.
const MAX_PIXELS: u64 = 1 << 26;

/// An image as PNG, 8-bit RGB.
///
/// # Errors
/// [`ShardError::Image`] if the image has no pixels.
pub fn encode_rgb(image: &RgbImage) -> Result<Vec<u8>, ShardError> {
    encode(image.as_raw(), image.dimensions(), ColorType::Rgb)
}

/// A mask as PNG, 8-bit grey.
///
/// # Errors
/// [`ShardError::Image`] if the mask has no pixels.
pub fn encode_mask(mask: &GrayImage) -> Result<Vec<u8>, ShardError> {
    encode(mask.as_raw(), mask.dimensions(), ColorType::Grayscale)
}

/// The image in a PNG of 8-bit RGB.
///
/// # Errors
/// [`ShardError::Image`] if the PNG is damaged, has another pixel format, or more than 64 Mi pixels.
pub fn decode_rgb(bytes: &[u8]) -> Result<RgbImage, ShardError> {
    let ((width, height), pixels) = decode(bytes, ColorType::Rgb)?;
    RgbImage::from_raw(width, height, pixels).ok_or_else(|| too_many((width, height)))
}

/// The mask in a PNG of 8-bit grey.
///
/// # Errors
/// As [`decode_rgb`].
pub fn decode_mask(bytes: &[u8]) -> Result<GrayImage, ShardError> {
    let ((width, height), pixels) = decode(bytes, ColorType::Grayscale)?;
    GrayImage::from_raw(width, height, pixels).ok_or_else(|| too_many((width, height)))
}

/// Checks that a mask holds 0 and 255 only.
pub(super) fn check_mask(mask: &GrayImage) -> Result<(), ShardError> {
    let mut pixels = mask.enumerate_pixels();
    match pixels.find(|(_, _, pixel)| !matches!(pixel.0[0], 0 | 255)) {
        Some((x, y, pixel)) => Err(ShardError::Image(format!(
            "the mask has the value {} at pixel ({x}, {y}): only 0 and 255 are allowed",
            pixel.0[0]
        ))),
        None => Ok(()),
    }
}

fn too_many((width, height): (u32, u32)) -> ShardError {
    ShardError::Image(format!(
        "the PNG claims {width}x{height} pixels, more than the limit of {MAX_PIXELS}"
    ))
}

fn encode(
    pixels: &[u8],
    (width, height): (u32, u32),
    color: ColorType,
) -> Result<Vec<u8>, ShardError> {
    let mut bytes = Vec::with_capacity(pixels.len() / 2 + 1024);
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(pixels)?;
        writer.finish()
    });
    written.map_err(|error| {
        ShardError::Image(format!(
            "could not encode an image of {width}x{height} pixels as PNG: {error}"
        ))
    })?;
    Ok(bytes)
}

fn decode(bytes: &[u8], color: ColorType) -> Result<((u32, u32), Vec<u8>), ShardError> {
    let damaged = |error| {
        ShardError::Image(format!(
            "the PNG is damaged: restore it, or extract the session again: {error}"
        ))
    };
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.ignore_checksums(false);
    let mut reader = decoder.read_info().map_err(damaged)?;
    let info = reader.info();
    let size = (info.width, info.height);
    if (info.color_type, info.bit_depth) != (color, BitDepth::Eight) {
        return Err(ShardError::Image(format!(
            "the PNG is {:?} with {} bits, but {color:?} with 8 bits was expected",
            info.color_type, info.bit_depth as u8
        )));
    }
    if u64::from(size.0) * u64::from(size.1) > MAX_PIXELS {
        return Err(too_many(size));
    }
    let length = reader.output_buffer_size();
    let mut pixels = vec![0; length.ok_or_else(|| too_many(size))?];
    reader.next_frame(&mut pixels).map_err(damaged)?;
    reader.finish().map_err(damaged)?;
    Ok((size, pixels))
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Luma, Rgb};
    use proptest::prelude::*;

    fn image() -> RgbImage {
        RgbImage::from_fn(13, 9, |x, y| {
            Rgb([(x * 19) as u8, (y * 28) as u8, (x * y) as u8])
        })
    }

    #[test]
    fn an_image_and_a_mask_come_back_as_they_were() {
        let mask = GrayImage::from_fn(5, 7, |x, y| Luma([if x > y { 255 } else { 0 }]));
        assert_eq!(decode_rgb(&encode_rgb(&image()).unwrap()).unwrap(), image());
        assert_eq!(decode_mask(&encode_mask(&mask).unwrap()).unwrap(), mask);
    }

    #[test]
    fn another_pixel_format_is_refused() {
        let png = encode_rgb(&image()).unwrap();
        assert!(matches!(decode_mask(&png), Err(ShardError::Image(_))));
        assert!(encode_rgb(&RgbImage::new(0, 3)).is_err());
    }

    #[test]
    fn a_png_that_claims_a_huge_image_is_refused_before_memory_is_allocated() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 1 << 30, 1 << 30);
        encoder.set_color(ColorType::Rgb);
        drop(encoder.write_header().unwrap());
        assert!(decode_rgb(&bytes).is_err());
    }

    proptest! {
        #[test]
        fn damage_to_a_png_is_an_error_or_harmless(at in any::<prop::sample::Index>(), bit in 0..8_u8) {
            let mut png = encode_rgb(&image()).unwrap();
            let at = at.index(png.len());
            png[at] ^= 1_u8 << bit;
            if let Ok(decoded) = decode_rgb(&png) {
                prop_assert_eq!(decoded, image());
            }
        }

        #[test]
        fn garbage_is_an_error(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
            prop_assert!(decode_rgb(&bytes).is_err());
        }
    }
}
