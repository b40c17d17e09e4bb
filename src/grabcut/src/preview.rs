//! Pictures of a mask: the image by which a person checks it, and PNG in memory.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{GrayImage, ImageBuffer, PixelWithColorType, RgbImage};

use super::MaskError;
use super::bitmap::Bitmap;

const BRIGHT: [u8; 3] = [0, 255, 80];
const DARK: [u8; 3] = [10, 10, 10];
/// Brightness of the dimmed background, percent.
const DIMMED: u16 = 60;
/// The outline is one pixel wide for each so many pixels of the frame's shorter side.
const SIDE_PER_PX: u32 = 500;

/// The frame with its background dimmed and a bright outline around the mask, with a dark rim on both
/// sides. The outline is 2 pixels wide, and wider for frames above 1500 pixels. If mask and frame
/// differ in size, the frame is returned unchanged.
pub fn preview(frame: &RgbImage, mask: &GrayImage) -> RgbImage {
    let size = frame.dimensions();
    if mask.dimensions() != size {
        return frame.clone();
    }
    let object = Bitmap::from_mask(mask);
    let width = (size.0.min(size.1) / SIDE_PER_PX).max(2) as usize;
    let line = object.dilated(width);
    let outer_rim = line.dilated(1);
    let ground = object.inverted().dilated(1);
    let mut image = frame.clone();
    for (at, pixel) in image.pixels_mut().enumerate() {
        let is = |bitmap: &Bitmap| bitmap.bits()[at];
        pixel.0 = match (is(&object), is(&line), is(&outer_rim)) {
            (true, ..) if is(&ground) => DARK,
            (true, ..) => pixel.0,
            (false, true, _) => BRIGHT,
            (false, false, true) => DARK,
            (false, false, false) => pixel.0.map(dimmed),
        };
    }
    image
}

fn dimmed(level: u8) -> u8 {
    (u16::from(level) * DIMMED / 100) as u8
}

/// A grey image as PNG, without filters: best for flat areas. `what` names the image in the error.
///
/// # Errors
/// [`MaskError::Encode`].
pub fn grey_png(image: &GrayImage, what: &'static str) -> Result<Vec<u8>, MaskError> {
    png(
        image,
        (CompressionType::Default, FilterType::NoFilter),
        what,
    )
}

/// A colour image as PNG, with fast compression. `what` names the image in the error.
///
/// # Errors
/// [`MaskError::Encode`].
pub fn rgb_png(image: &RgbImage, what: &'static str) -> Result<Vec<u8>, MaskError> {
    png(image, (CompressionType::Fast, FilterType::Adaptive), what)
}

fn png<P>(
    image: &ImageBuffer<P, Vec<u8>>,
    (compression, filter): (CompressionType, FilterType),
    what: &'static str,
) -> Result<Vec<u8>, MaskError>
where
    P: PixelWithColorType<Subpixel = u8>,
{
    let mut bytes = Vec::new();
    let encoder = PngEncoder::new_with_quality(&mut bytes, compression, filter);
    let written = image.write_with_encoder(encoder);
    written.map_err(|source| MaskError::Encode { what, source })?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use image::{Luma, Rgb};

    use super::*;

    #[test]
    fn the_outline_is_around_the_mask_and_the_object_keeps_its_colours() {
        let frame = RgbImage::from_pixel(40, 40, Rgb([200, 100, 50]));
        let inside = |x: u32, y: u32| (10..30).contains(&x) && (10..30).contains(&y);
        let mask = GrayImage::from_fn(40, 40, |x, y| Luma([if inside(x, y) { 255 } else { 0 }]));
        let image = preview(&frame, &mask);
        let row: Vec<[u8; 3]> = (5..13).map(|x| image.get_pixel(x, 20).0).collect();
        let (ground, object) = ([120, 60, 30], [200, 100, 50]);
        let wanted = [ground, ground, DARK, BRIGHT, BRIGHT, DARK, object, object];
        assert_eq!(row, wanted);
    }

    #[test]
    fn a_mask_of_another_size_leaves_the_frame_alone() {
        let frame = RgbImage::from_pixel(20, 20, Rgb([1, 2, 3]));
        assert_eq!(preview(&frame, &GrayImage::new(3, 3)), frame);
    }
}
