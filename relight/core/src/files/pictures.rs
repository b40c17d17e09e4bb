//! Pictures, panoramas, maps of normals, coefficients of light and captured objects in files.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Path, PathBuf};

use relit_data::durable::write_whole;
use relit_data::file_names::has_extension;
use relit_data::text;

use crate::captured_object::CapturedObject;
use crate::image::{
    ColourImage, Depth, Extent, ImageError, Linear, Planes, Rgb, Samples, Srgb, StoredImage,
    Transfer, encode_exr, encode_jpeg, encode_png, encode_png_of,
};
use crate::light::{LightError, Normals, Panorama, ShLight};

/// Writes values of 0 to 1 as integers; others are clipped.
///
/// # Errors
/// If the file cannot be written.
pub fn write_png(path: &Path, planes: &Planes<3>, depth: Depth) -> Result<(), ImageError> {
    write(path, &encode_png(path, planes, depth)?)
}

/// The same of a picture whose pixels are computed while it is written: `pixel` is given a row's number times the width,
/// plus the column's.
///
/// # Errors
/// If the file cannot be written.
pub fn write_png_of(
    path: &Path,
    extent: Extent,
    depth: Depth,
    pixel: impl Fn(usize) -> [f32; 3] + Sync,
) -> Result<(), ImageError> {
    write(path, &encode_png_of(path, extent, depth, pixel)?)
}

/// Writes values of 0 to 1 with 8 bits and a little loss; others are clipped.
///
/// # Errors
/// If the file cannot be written.
pub fn write_jpeg(path: &Path, planes: &Planes<3>) -> Result<(), ImageError> {
    write(path, &encode_jpeg(path, planes)?)
}

/// Writes the values as they are, 32-bit floating point.
///
/// # Errors
/// If the file cannot be written.
pub fn write_exr(path: &Path, planes: &Planes<3>) -> Result<(), ImageError> {
    write(path, &encode_exr(path, planes)?)
}

/// Reads the colours of an image as [`StoredImage::read`], and returns the type of its numbers.
///
/// # Errors
/// If the file cannot be read or is not an image of a known format.
pub fn read_planes(path: &Path) -> Result<(Planes<3>, Samples), ImageError> {
    let image = StoredImage::read(path)?;
    Ok((image.planes, image.samples))
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let written = fs::create_dir_all(folder).and_then(|()| write_whole(path, bytes));
    written.map_err(ImageError::write(path))
}

impl StoredImage {
    /// Reads an image; see [`StoredImage::from_bytes`].
    ///
    /// # Errors
    /// If the file cannot be read or is not an image of a known format.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let bytes = fs::read(path).map_err(ImageError::open(path))?;
        Self::from_bytes(path, &bytes)
    }
}

impl ColourImage {
    /// Reads a picture; see [`ColourImage::from_bytes`].
    ///
    /// # Errors
    /// If the file cannot be read or is not an image of a known format, or its colours cannot be converted.
    pub fn read(path: &Path, transfer: Option<Transfer>) -> Result<Self, ImageError> {
        let bytes = fs::read(path).map_err(ImageError::open(path))?;
        Self::from_bytes(path, &bytes, transfer)
    }
}

impl Rgb<Linear> {
    /// Reads the light of a file whose integers are encoded as `transfer` says, whatever the file says; see
    /// [`ColourImage::from_bytes`]. Alpha is left out; grey becomes three equal channels.
    ///
    /// # Errors
    /// If the file cannot be read or is not an image of these formats.
    pub fn read(path: &Path, transfer: Transfer) -> Result<Self, ImageError> {
        Ok(ColourImage::read(path, Some(transfer))?.into_light())
    }

    /// Writes the light as it is, in 32-bit floating point values.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_exr(&self, path: &Path) -> Result<(), ImageError> {
        write_exr(path, self.planes())
    }
}

impl Rgb<Srgb> {
    /// Writes an 8-bit PNG; values beyond 0 to 1 are clipped.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_png(&self, path: &Path) -> Result<(), ImageError> {
        write_png(path, self.planes(), Depth::Eight)
    }
}

impl Panorama {
    /// Reads an HDR (Radiance) or EXR file.
    ///
    /// # Errors
    /// If it cannot be read, is of integers, is not twice as wide as high, or has values that are not finite.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let bytes = fs::read(path).map_err(ImageError::open(path))?;
        Self::from_bytes(path, &bytes)
    }
}

impl Normals {
    /// Reads a PNG, 8 or 16 bits, of colours `(n + 1) / 2`, or an EXR of the vectors themselves. No
    /// file does not state the direction of y: the caller gives it by `Y`.
    ///
    /// # Errors
    /// If the file cannot be read or is not an image.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let (planes, samples) = read_planes(path)?;
        Ok(match samples {
            Samples::Integer => Self::from_colours(planes),
            Samples::Float => Self::new(planes),
        })
    }

    /// Writes a PNG of colours `(n + 1) / 2`.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_png(&self, path: &Path, depth: Depth) -> Result<(), ImageError> {
        let extent = self.planes().extent();
        write_png_of(path, extent, depth, |at| self.colour_at(at))
    }
}

impl ShLight {
    /// Reads the text form.
    ///
    /// # Errors
    /// If the file cannot be read or holds something else.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let text = text::read(path).map_err(ImageError::open(path))?;
        text.parse()
            .map_err(|error: LightError| ImageError::file(path, format!("holds no light: {error}")))
    }

    /// Writes the text form.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ImageError> {
        let written = write_whole(path, self.to_string().as_bytes());
        written.map_err(ImageError::write(path))
    }
}

impl CapturedObject {
    /// Whether a path is that of a captured object: a file that is called so (`.relit`), or a folder with one
    /// ([`Self::FILE`]).
    pub fn is_named(path: &Path) -> bool {
        has_extension(path, &["relit"]) || path.join(Self::FILE).is_file()
    }

    /// Reads a file, or that in a folder of `relight turn`.
    ///
    /// # Errors
    /// If it cannot be read or is not a captured object that this version can read.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let path = &file_of(path);
        let mut content = Vec::new();
        File::open(path)
            .and_then(|file| file.take(Self::MAX_BYTES + 1).read_to_end(&mut content))
            .map_err(ImageError::open(path))?;
        let none = "is not a captured object: give object.relit, or the folder of relight turn";
        Self::from_bytes(&content)
            .map_err(|error| ImageError::file(path, format!("{none}: {error}")))
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), ImageError> {
        write_whole(path, &self.to_bytes()?).map_err(ImageError::write(path))
    }
}

/// The captured object's file at a path, which may be that of its folder.
fn file_of(path: &Path) -> PathBuf {
    if path.is_dir() {
        path.join(CapturedObject::FILE)
    } else {
        path.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ramp() -> Planes<3> {
        Planes::from_fn(Extent::new(7, 3), |x, y| {
            [x as f32 / 6.0, y as f32 / 2.0, (x * y) as f32 / 12.0]
        })
    }

    fn largest_difference(a: &Planes<3>, b: &Planes<3>) -> f32 {
        let pairs = a.planes().into_iter().zip(b.planes());
        pairs
            .flat_map(|(a, b)| a.iter().zip(b))
            .map(|(a, b)| (a - b).abs())
            .fold(0.0, f32::max)
    }

    #[test]
    fn a_png_comes_back_within_its_depth() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ramp.png");
        for (depth, step) in [(Depth::Eight, 255.0), (Depth::Sixteen, 65535.0)] {
            write_png(&path, &ramp(), depth).unwrap();
            let (back, samples) = read_planes(&path).unwrap();
            assert_eq!(samples, Samples::Integer);
            assert!(
                largest_difference(&back, &ramp()) <= 0.51 / step,
                "{depth:?}"
            );
        }
    }

    #[test]
    fn an_exr_comes_back_bit_for_bit_and_is_known_to_be_linear() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("ramp.exr");
        let bright = ramp().map(|v| v * 1000.0 - 1.0);
        write_exr(&path, &bright).unwrap();
        assert_eq!(read_planes(&path).unwrap(), (bright, Samples::Float));
    }

    #[test]
    fn a_jpeg_comes_back_nearly_and_a_folder_that_is_missing_is_made() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("new").join("deep").join("ramp.jpg");
        let smooth = Planes::from_fn(Extent::new(64, 48), |x, y| {
            [x as f32 / 63.0, y as f32 / 47.0, 0.5]
        });
        write_jpeg(&path, &smooth).unwrap();
        let (back, samples) = read_planes(&path).unwrap();
        assert_eq!(samples, Samples::Integer);
        assert!(largest_difference(&back, &smooth) < 0.03);
    }

    #[test]
    fn half_a_picture_is_an_error_in_every_format() {
        let folder = tempfile::tempdir().unwrap();
        let noise = Planes::from_fn(Extent::new(64, 48), |x, y| {
            [0, 1, 2].map(|c| ((x * 31 + y * 17 + c * 7) % 64) as f32 / 63.0)
        });
        let bytes = noise.to_bytes();
        let mut webp = Vec::new();
        image::codecs::webp::WebPEncoder::new_lossless(&mut webp)
            .encode(&bytes, 64, 48, image::ExtendedColorType::Rgb8)
            .unwrap();
        let path = Path::new("half");
        let files = [
            encode_png(path, &noise, Depth::Eight).unwrap(),
            encode_jpeg(path, &noise).unwrap(),
            encode_exr(path, &noise).unwrap(),
            webp,
        ];
        for (number, whole) in files.into_iter().enumerate() {
            let file = folder.path().join(format!("{number}"));
            std::fs::write(&file, &whole).unwrap();
            assert!(StoredImage::read(&file).is_ok(), "{number}");
            for part in [2, 3, 6, 9] {
                std::fs::write(&file, &whole[..whole.len() * part / 10]).unwrap();
                assert!(StoredImage::read(&file).is_err(), "{number} {part}");
            }
        }
    }

    #[test]
    fn a_file_that_is_no_image_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notes.png");
        std::fs::write(&path, "not an image").unwrap();
        let error = read_planes(&path).unwrap_err();
        assert!(error.to_string().contains("notes.png"), "{error}");
    }

    #[test]
    fn an_image_that_claims_too_many_pixels_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("vast.png");
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 20_000, 20_000);
        encoder.set_color(png::ColorType::Rgb);
        // There is no pixel behind the header.
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(png::chunk::IDAT, &[]).unwrap();
        drop(writer);
        std::fs::write(&path, bytes).unwrap();
        let error = read_planes(&path).unwrap_err();
        assert!(error.to_string().contains("vast.png"), "{error}");
    }

    #[test]
    fn light_with_a_byte_order_mark_is_the_same_light() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("light.txt");
        let light = ShLight::even(crate::light::Order::TWO, [0.25, 0.5, 1.0]);
        let text = light.to_string();
        std::fs::write(&path, format!("\u{feff}{}", text.replace('\n', "\r\n"))).unwrap();
        assert_eq!(ShLight::read(&path).unwrap(), light);
        let wide: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        std::fs::write(&path, [&b"\xff\xfe"[..], &wide].concat()).unwrap();
        let fault = ShLight::read(&path).unwrap_err();
        assert!(fault.to_string().contains("light.txt"), "{fault}");
    }

    #[test]
    fn an_image_without_pixels_is_not_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("empty.exr");
        assert!(write_exr(&path, &Planes::zeros(Extent::new(0, 0))).is_err());
        assert!(!path.exists());
    }
}
