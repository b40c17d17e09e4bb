//! Pictures reduced while they are decoded, to save memory.

use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::imageops::FilterType as Kernel;
use image::{ColorType, DynamicImage};

use relit_data::still::Colour;

use super::codec::{decode, encode_exr, to_integer};
use super::colour_image::colour_of;
use super::{ColourImage, ColourSpace, Extent, ImageError, Srgb, Transfer};

/// A picture that was made smaller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DownscaledFile {
    /// The file.
    pub bytes: Vec<u8>,
    /// How its name ends: `png`, or `exr` where values are floating point.
    pub ending: &'static str,
}

impl DownscaledFile {
    /// The picture of a file with at most so many pixels, turned as it is displayed; `None` if the file has no more, or has
    /// floating point values with alpha. Integers are averaged as encoded, and converted to sRGB;
    /// their encoding is `transfer`, or else that of the file. Errors name it as `path`.
    ///
    /// # Errors
    /// If it is not an image of a known format, is too large or cut off, or its colours cannot be converted.
    pub fn new(
        path: &Path,
        bytes: &[u8],
        most: usize,
        transfer: Option<Transfer>,
    ) -> Result<Option<Self>, ImageError> {
        let image = decode(path, bytes)?;
        let [width, height] = [image.width(), image.height()];
        let pixels = f64::from(width) * f64::from(height);
        if pixels <= most as f64 {
            return Ok(None);
        }
        let scale = (most as f64 / pixels).sqrt();
        let [width, height] = [width, height].map(|side| ((f64::from(side) * scale) as u32).max(1));
        match image.color() {
            ColorType::Rgba32F => Ok(None),
            // What resizes integers clips values beyond 1.
            ColorType::Rgb32F => {
                let extent = Extent::new(width as usize, height as usize);
                let light = ColourImage::from_bytes(path, bytes, None)?.into_light();
                Ok(Some(Self {
                    bytes: encode_exr(path, &light.planes().resized(extent))?,
                    ending: "exr",
                }))
            }
            _ => {
                let smaller = image.resize_exact(width, height, Kernel::Triangle);
                // Half of the memory is free again before the picture is encoded.
                drop(image);
                let smaller = in_srgb(smaller, &colour_of(path, bytes, transfer)?);
                Ok(Some(Self {
                    bytes: png(path, smaller)?,
                    ending: "png",
                }))
            }
        }
    }
}

fn png(path: &Path, image: DynamicImage) -> Result<Vec<u8>, ImageError> {
    let mut file = Vec::new();
    let encoder =
        PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Adaptive);
    let encoded = plain(image).write_with_encoder(encoder);
    encoded.map_err(ImageError::encode(path))?;
    Ok(file)
}

/// The same in sRGB, with 16 bits where anything changes.
fn in_srgb(image: DynamicImage, colour: &Colour) -> DynamicImage {
    if colour.is_srgb() {
        return image;
    }
    let has_alpha = image.color().has_alpha();
    let mut pixels = image.into_rgba16();
    let planes: [Vec<f32>; 3] = [0, 1, 2].map(|channel| {
        let values = pixels.pixels().map(|pixel| pixel.0[channel]);
        values.map(|value| f32::from(value) / 65535.0).collect()
    });
    let [mut red, mut green, mut blue] = planes;
    colour.to_light([&mut red, &mut green, &mut blue]);
    for (channel, plane) in [red, green, blue].into_iter().enumerate() {
        for (pixel, light) in pixels.pixels_mut().zip(plane) {
            pixel.0[channel] = to_integer(Srgb::from_linear(light), 65535.0) as u16;
        }
    }
    if has_alpha {
        DynamicImage::ImageRgba16(pixels)
    } else {
        DynamicImage::ImageRgb16(DynamicImage::ImageRgba16(pixels).into_rgb16())
    }
}

/// Colours with alpha where there is some.
fn plain(image: DynamicImage) -> DynamicImage {
    match image.color() {
        ColorType::La8 => DynamicImage::ImageRgba8(image.into_rgba8()),
        ColorType::La16 => DynamicImage::ImageRgba16(image.into_rgba16()),
        _ => image,
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Planes, StoredImage, encode_jpeg};
    use super::*;

    fn ramp(extent: Extent) -> Planes<3> {
        Planes::from_fn(extent, |x, y| {
            [
                x as f32 / extent.width as f32,
                y as f32 / extent.height as f32,
                0.5,
            ]
        })
    }

    #[test]
    fn a_large_picture_is_made_as_small_as_it_has_to_be() {
        let path = Path::new("a.jpg");
        let file = encode_jpeg(path, &ramp(Extent::new(300, 200))).unwrap();
        assert_eq!(
            DownscaledFile::new(path, &file, 60_000, None).unwrap(),
            None
        );
        let downscaled = DownscaledFile::new(path, &file, 15_000, None)
            .unwrap()
            .unwrap();
        assert_eq!(downscaled.ending, "png");
        let image = StoredImage::from_bytes(path, &downscaled.bytes).unwrap();
        assert_eq!(image.planes.extent(), Extent::new(150, 100));
        let [r, g, _] = image.planes.pixel(75, 20);
        assert!(
            (r - 0.503).abs() < 0.03 && (g - 0.205).abs() < 0.03,
            "{r} {g}"
        );
    }

    #[test]
    fn values_in_floating_point_stay_so() {
        let path = Path::new("a.exr");
        let bright = ramp(Extent::new(40, 40)).map(|value| value * 7.0);
        let file = encode_exr(path, &bright).unwrap();
        let downscaled = DownscaledFile::new(path, &file, 400, None)
            .unwrap()
            .unwrap();
        assert_eq!(downscaled.ending, "exr");
        let image = StoredImage::from_bytes(path, &downscaled.bytes).unwrap();
        assert!(image.planes.pixel(19, 0)[0] > 6.0);
    }

    #[test]
    fn what_is_no_picture_is_refused() {
        assert!(DownscaledFile::new(Path::new("a.png"), b"no picture", 1, None).is_err());
    }
}
