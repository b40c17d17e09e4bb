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
/// [`ShardError::Encode`] if the image has no pixels.
pub fn encode_rgb(image: &RgbImage) -> Result<Vec<u8>, ShardError> {
    encode(image.as_raw(), image.dimensions(), ColorType::Rgb)
}

/// A mask as PNG, 8-bit grey.
///
/// # Errors
/// [`ShardError::Encode`] if the mask has no pixels.
pub fn encode_mask(mask: &GrayImage) -> Result<Vec<u8>, ShardError> {
    encode(mask.as_raw(), mask.dimensions(), ColorType::Grayscale)
}

/// The image in a PNG of 8-bit RGB.
///
/// # Errors
/// [`ShardError::Decode`] if the PNG is damaged, [`ShardError::PixelFormat`] if it has another pixel format,
/// [`ShardError::TooManyPixels`] above 64 Mi pixels.
pub fn decode_rgb(bytes: &[u8]) -> Result<RgbImage, ShardError> {
    let (width, height, pixels) = decode(bytes, ColorType::Rgb, "8-bit RGB")?;
    RgbImage::from_raw(width, height, pixels).ok_or(ShardError::TooManyPixels {
        width,
        height,
        limit: MAX_PIXELS,
    })
}

/// The mask in a PNG of 8-bit grey.
///
/// # Errors
/// As [`decode_rgb`].
pub fn decode_mask(bytes: &[u8]) -> Result<GrayImage, ShardError> {
    let (width, height, pixels) = decode(bytes, ColorType::Grayscale, "8-bit grey")?;
    GrayImage::from_raw(width, height, pixels).ok_or(ShardError::TooManyPixels {
        width,
        height,
        limit: MAX_PIXELS,
    })
}

/// Checks that a mask holds 0 and 255 only.
pub(super) fn check_mask(mask: &GrayImage) -> Result<(), ShardError> {
    match mask
        .enumerate_pixels()
        .find(|(_, _, pixel)| !matches!(pixel.0[0], 0 | 255))
    {
        Some((x, y, pixel)) => Err(ShardError::MaskValue {
            value: pixel.0[0],
            x,
            y,
        }),
        None => Ok(()),
    }
}

fn encode(
    pixels: &[u8],
    (width, height): (u32, u32),
    color: ColorType,
) -> Result<Vec<u8>, ShardError> {
    let failed = |source| ShardError::Encode {
        width,
        height,
        source,
    };
    let mut bytes = Vec::with_capacity(pixels.len() / 2 + 1024);
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_compression(Compression::Fast);
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(pixels).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}

fn decode(
    bytes: &[u8],
    color: ColorType,
    expected: &'static str,
) -> Result<(u32, u32, Vec<u8>), ShardError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.ignore_checksums(false);
    let mut reader = decoder.read_info()?;
    let info = reader.info();
    let (width, height) = (info.width, info.height);
    if (info.color_type, info.bit_depth) != (color, BitDepth::Eight) {
        let found = format!("{:?} with {} bits", info.color_type, info.bit_depth as u8);
        return Err(ShardError::PixelFormat { found, expected });
    }
    let too_many = ShardError::TooManyPixels {
        width,
        height,
        limit: MAX_PIXELS,
    };
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(too_many);
    }
    let mut pixels = vec![0; reader.output_buffer_size().ok_or(too_many)?];
    reader.next_frame(&mut pixels)?;
    reader.finish()?;
    Ok((width, height, pixels))
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
        assert!(matches!(
            decode_mask(&png),
            Err(ShardError::PixelFormat { .. })
        ));
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
