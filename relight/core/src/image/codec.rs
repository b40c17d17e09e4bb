//! Encoded pictures: what `relit_data::still` decodes in, JPEG and EXR out. Knows bytes only: a path is how errors name a picture.

use std::io::Cursor;
use std::path::Path;

use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageBuffer, ImageEncoder, ImageFormat, Pixel, Rgb};
use relit_data::mask::MaskPicture;

use super::{Extent, ImageError, Planes};

/// The quality of a JPEG, 1 to 100: differences are not seen, and a file is a third of a PNG's.
const JPEG_QUALITY: u8 = 95;

/// How exactly a PNG holds values.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Depth {
    /// 8 bits a channel.
    Eight,
    /// 16 bits a channel.
    Sixteen,
}

/// What the numbers in a file were.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Samples {
    /// Integers, scaled to 0 to 1.
    Integer,
    /// Floating point values, as they stood.
    Float,
}

/// Values of 0 to 1 in a JPEG of good quality; others are clipped.
///
/// # Errors
/// If the picture, called `path`, cannot be encoded.
pub fn encode_jpeg(path: &Path, planes: &Planes<3>) -> Result<Vec<u8>, ImageError> {
    let [width, height] = planes.extent().sides();
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY)
        .write_image(
            &planes.to_bytes(),
            width,
            height,
            image::ExtendedColorType::Rgb8,
        )
        .map_err(ImageError::encode(path))?;
    Ok(bytes)
}

/// The values as they are, 32-bit floating point, in an EXR.
///
/// # Errors
/// If the picture, called `path`, cannot be encoded.
pub fn encode_exr(path: &Path, planes: &Planes<3>) -> Result<Vec<u8>, ImageError> {
    let [width, height] = planes.extent().sides();
    let values: Vec<f32> = interleaved(planes, |v| [v]);
    let mut bytes = Cursor::new(Vec::new());
    // An image of no pixels makes no buffer; it is refused by the encoder.
    let buffer = ImageBuffer::<Rgb<f32>, _>::from_raw(width, height, values).unwrap_or_default();
    DynamicImage::ImageRgb32F(buffer)
        .write_to(&mut bytes, ImageFormat::OpenExr)
        .map_err(ImageError::encode(path))?;
    Ok(bytes.into_inner())
}

impl Planes<3> {
    /// The pixels as 8-bit integers, red, green and blue in turn; values beyond 0 to 1 are clipped.
    pub fn to_bytes(&self) -> Vec<u8> {
        interleaved(self, |v| [to_integer(v, 255.0) as u8])
    }
}

/// An image as stored, without colour conversion: a mask, normals, or other data. For
/// colours see [`ColourImage`](super::ColourImage).
#[derive(Debug, Clone, PartialEq)]
pub struct StoredImage {
    /// The colours: integers scaled to 0 to 1, floating point values as they are. Grey is three equal
    /// channels.
    pub planes: Planes<3>,
    /// Alpha, 0 to 1, where the file has it and it is not 1 everywhere.
    pub alpha: Option<Planes<1>>,
    /// What the numbers were.
    pub samples: Samples,
}

impl StoredImage {
    /// Decodes the content of a file, turned as it is displayed. Colours of an EXR with alpha, which that
    /// format holds multiplied with it, are divided by it. Errors name it as `path`.
    ///
    /// # Errors
    /// If it is not an image of a known format, is too large, or is cut off.
    pub fn from_bytes(path: &Path, bytes: &[u8]) -> Result<Self, ImageError> {
        let mut image = decode(path, bytes)?;
        if let DynamicImage::ImageRgba32F(pixels) = &mut image {
            for pixel in pixels.pixels_mut() {
                let alpha = if pixel[3] > 0.0 { pixel[3] } else { 1.0 };
                pixel.0[..3].iter_mut().for_each(|value| *value /= alpha);
            }
        }
        Self::from_image(image)
    }

    /// A picture in memory, whose colours are not multiplied with its alpha.
    ///
    /// # Errors
    /// None for a picture as it comes from the crate `image`.
    pub fn from_image(image: DynamicImage) -> Result<Self, ImageError> {
        let samples = match image {
            DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => Samples::Float,
            _ => Samples::Integer,
        };
        if !image.color().has_alpha() {
            return Ok(Self {
                planes: split(&image.into_rgb32f()),
                alpha: None,
                samples,
            });
        }
        let with_alpha: Planes<4> = split(&image.into_rgba32f());
        let extent = with_alpha.extent();
        let [red, green, blue, alpha] = with_alpha.into_planes();
        let is_opaque = alpha.iter().all(|&alpha| alpha >= 1.0);
        Ok(Self {
            planes: Planes::from_planes(extent, [red, green, blue])?,
            alpha: if is_opaque {
                None
            } else {
                Some(Planes::from_planes(extent, [alpha])?)
            },
            samples,
        })
    }

    /// The mask that the picture shows, 1 on the object and 0 elsewhere, and a note on it for a person. Errors name it as `path`.
    ///
    /// # Errors
    /// If it shows none.
    pub fn object_mask(&self, path: &Path) -> Result<(Planes<1>, Option<String>), ImageError> {
        let extent = self.planes.extent();
        let alpha = self.alpha.as_ref().map(|alpha| alpha.plane(0));
        let picture = MaskPicture::from_planes(extent.sides().into(), self.planes.planes(), alpha);
        let object = picture
            .object()
            .map_err(|fault| ImageError::Other(format!("the mask {} {fault}", path.display())))?;
        let values = object
            .inside
            .iter()
            .map(|&inside| f32::from(u8::from(inside)));
        let mask = Planes::from_planes(extent, [values.collect()])?;
        Ok((mask, object.note(extent.sides()[0])))
    }
}

/// The picture as it is displayed.
pub(super) fn decode(path: &Path, bytes: &[u8]) -> Result<DynamicImage, ImageError> {
    relit_data::still::decode(bytes).map_err(ImageError::still(path))
}

fn split<P: Pixel<Subpixel = f32>, const C: usize>(image: &ImageBuffer<P, Vec<f32>>) -> Planes<C> {
    let extent = Extent::new(image.width() as usize, image.height() as usize);
    let mut planes = Planes::zeros(extent);
    for (channel, plane) in planes.planes_mut().into_iter().enumerate() {
        for (value, pixel) in plane.iter_mut().zip(image.as_raw().chunks_exact(C)) {
            *value = pixel[channel];
        }
    }
    planes
}

fn interleaved<T: Copy, const N: usize>(
    planes: &Planes<3>,
    pack: impl Fn(f32) -> [T; N],
) -> Vec<T> {
    let [red, green, blue] = planes.planes();
    red.iter()
        .zip(green)
        .zip(blue)
        .flat_map(|((&r, &g), &b)| [r, g, b])
        .flat_map(pack)
        .collect()
}

/// The nearest integer of 0 to `most`; what is not a number becomes 0.
pub(super) fn to_integer(value: f32, most: f32) -> f32 {
    (value.clamp(0.0, 1.0) * most).round()
}
