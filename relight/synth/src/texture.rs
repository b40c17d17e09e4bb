//! Pictures that are laid onto objects.

use std::io::Cursor;
use std::sync::LazyLock;

use glam::{Vec2, Vec3};
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageError as FileError, ImageReader, Limits, RgbImage};

use relight_core::image::{ColourSpace, Linear, Srgb};

/// Longest side of a mesh's own pictures in memory: larger ones are reduced.
const MAX_SIDE: usize = 1024;

/// Quality of the JPEG of a mesh's picture in a packed library, 1 to 100.
const JPEG_QUALITY: u8 = 88;

/// A picture in linear light, which repeats itself in all directions.
#[derive(Debug, Clone)]
pub(crate) struct TextureImage {
    width: usize,
    height: usize,
    texels: Texels,
    mean: Vec3,
    transparent_fraction: f32,
}

/// Values of a picture, row by row.
#[derive(Debug, Clone)]
enum Texels {
    Light(Vec<Vec3>),
    /// As in the file, in a quarter of the memory, with the value of each level.
    Levels(Vec<[u8; 3]>, PictureKind),
}

/// What the values of a mesh's picture are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum PictureKind {
    /// sRGB.
    Colours,
    /// Roughness and metal, in proportion.
    Numbers,
}

static COLOURS: LazyLock<[f32; 256]> = LazyLock::new(|| levels(Srgb::to_linear));
static NUMBERS: LazyLock<[f32; 256]> = LazyLock::new(|| levels(Linear::to_linear));

fn levels(value: fn(f32) -> f32) -> [f32; 256] {
    std::array::from_fn(|level| value(level as f32 / 255.0))
}

impl PictureKind {
    /// What the 256 levels of a file stand for.
    fn values(self) -> &'static [f32; 256] {
        match self {
            Self::Colours => &COLOURS,
            Self::Numbers => &NUMBERS,
        }
    }

    fn encoded(self, value: f32) -> u8 {
        let level = match self {
            Self::Colours => Srgb::from_linear(value),
            Self::Numbers => value,
        };
        (level.clamp(0.0, 1.0) * 255.0).round() as u8
    }
}

impl Texels {
    fn at(&self, number: usize) -> Vec3 {
        match self {
            Self::Light(texels) => texels[number],
            Self::Levels(texels, kind) => {
                let values = kind.values();
                Vec3::from_array(texels[number].map(|level| values[usize::from(level)]))
            }
        }
    }
}

impl TextureImage {
    /// A picture of the colours that `at` gives for column and row.
    pub(crate) fn from_fn(width: usize, height: usize, at: impl Fn(usize, usize) -> Vec3) -> Self {
        let texels = (0..width * height).map(|k| at(k % width, k / width));
        Self::new([width, height], Texels::Light(texels.collect()))
    }

    fn new([width, height]: [usize; 2], texels: Texels) -> Self {
        let count = width * height;
        let sum: Vec3 = (0..count).map(|number| texels.at(number)).sum();
        Self {
            width,
            height,
            texels,
            mean: sum / count.max(1) as f32,
            transparent_fraction: 0.0,
        }
    }

    /// A picture of a mesh's own, PNG, JPEG or WebP. That of colours is sRGB: glTF has readers leave out what a file says
    /// of its colours and its orientation.
    pub(crate) fn decoded(bytes: &[u8], kind: PictureKind) -> Result<Self, FileError> {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
        let image = reader.decode()?;
        let transparent_fraction = transparent_fraction(&image);
        Ok(Self {
            transparent_fraction,
            ..Self::downscaled(&image.into_rgb8(), kind, MAX_SIDE)
        })
    }

    /// The same of a packed library's JPEG, with sides of at most `longest`.
    pub(crate) fn unpacked(
        bytes: &[u8],
        kind: PictureKind,
        longest: u32,
    ) -> Result<Self, FileError> {
        let mut reader = ImageReader::with_format(Cursor::new(bytes), image::ImageFormat::Jpeg);
        let mut limits = Limits::default();
        limits.max_image_width = Some(longest);
        limits.max_image_height = Some(longest);
        reader.limits(limits);
        let image = reader.decode()?.into_rgb8();
        Ok(Self::downscaled(&image, kind, MAX_SIDE))
    }

    /// The picture as a JPEG with sides of at most `longest`.
    ///
    /// # Errors
    /// If it has no pixels.
    pub(crate) fn packed(&self, kind: PictureKind, longest: usize) -> Result<Vec<u8>, FileError> {
        let (width, height) = (self.width, self.height);
        let means = Means::new([width, height], longest);
        let [columns, rows] = means.extent();
        let image = RgbImage::from_fn(columns as u32, rows as u32, |x, y| {
            let mean = means.at([x as usize, y as usize], |x, y| {
                self.texels.at(y * width + x)
            });
            image::Rgb(mean.to_array().map(|value| kind.encoded(value)))
        });
        let mut bytes = Vec::new();
        JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY).encode_image(&image)?;
        Ok(bytes)
    }

    /// Means over squares of the picture, so that no side is longer than `longest`.
    fn downscaled(image: &RgbImage, kind: PictureKind, longest: usize) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        if width.max(height) <= longest {
            let texels = image.pixels().map(|pixel| pixel.0).collect();
            return Self::new([width, height], Texels::Levels(texels, kind));
        }
        let values = kind.values();
        let means = Means::new([width, height], longest);
        let [columns, rows] = means.extent();
        Self::from_fn(columns, rows, |x, y| {
            means.at([x, y], |x, y| {
                let levels = image.get_pixel(x as u32, y as u32).0;
                Vec3::from_array(levels.map(|level| values[usize::from(level)]))
            })
        })
    }

    /// Part of the picture that is transparent in its file; it is shown as opaque.
    pub(crate) fn transparent_fraction(&self) -> f32 {
        self.transparent_fraction
    }

    /// The mean of all its colours; black without pixels.
    pub(super) fn mean(&self) -> Vec3 {
        self.mean
    }

    /// The colour at a place; the picture is 1 wide and high, v runs upwards. Bilinear. A picture
    /// without pixels is black.
    pub(super) fn at(&self, place: Vec2) -> Vec3 {
        if self.width * self.height == 0 {
            return Vec3::ZERO;
        }
        let x = (place.x - place.x.floor()) * self.width as f32 - 0.5;
        let y = (1.0 - (place.y - place.y.floor())) * self.height as f32 - 0.5;
        let (left, above) = (x.floor(), y.floor());
        let texel = |dx: i64, dy: i64| {
            let column = (left as i64 + dx).rem_euclid(self.width as i64) as usize;
            let row = (above as i64 + dy).rem_euclid(self.height as i64) as usize;
            self.texels.at(row * self.width + column)
        };
        let upper = texel(0, 0).lerp(texel(1, 0), x - left);
        let lower = texel(0, 1).lerp(texel(1, 1), x - left);
        upper.lerp(lower, y - above)
    }
}

/// The part of an image's pixels that are less than half opaque.
fn transparent_fraction(image: &DynamicImage) -> f32 {
    if !image.color().has_alpha() {
        return 0.0;
    }
    let alpha = image.to_luma_alpha8();
    let clear = alpha.pixels().filter(|pixel| pixel.0[1] < 128).count();
    clear as f32 / alpha.pixels().len().max(1) as f32
}

/// A picture cut into squares.
struct Means {
    sides: [usize; 2],
    square: usize,
}

impl Means {
    /// The smallest squares with at most `longest` in a row or column.
    fn new(sides: [usize; 2], longest: usize) -> Self {
        let square = sides[0].max(sides[1]).div_ceil(longest).max(1);
        Self { sides, square }
    }

    fn extent(&self) -> [usize; 2] {
        self.sides.map(|side| side.div_ceil(self.square))
    }

    /// The mean of what lies in a square.
    fn at(&self, square: [usize; 2], value: impl Fn(usize, usize) -> Vec3) -> Vec3 {
        let [columns, rows] = [0, 1].map(|axis| {
            let first = square[axis] * self.square;
            first..(first + self.square).min(self.sides[axis])
        });
        let count = (rows.len() * columns.len()).max(1) as f32;
        let places = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
        places.map(|(x, y)| value(x, y)).sum::<Vec3>() / count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_picture_is_made_smaller_by_means_of_its_light() {
        let image = RgbImage::from_fn(2048, 4, |x, _| {
            image::Rgb([if x % 2 == 0 { 255 } else { 0 }; 3])
        });
        let mut png = Vec::new();
        image
            .write_to(&mut Cursor::new(&mut png), image::ImageFormat::Png)
            .unwrap();
        let picture = TextureImage::decoded(&png, PictureKind::Colours).unwrap();
        assert_eq!((picture.width, picture.height), (1024, 2));
        assert!((0..2048).all(|number| (picture.texels.at(number).x - 0.5).abs() < 1e-6));
        assert_eq!(picture.mean(), picture.texels.at(0));
        assert!(TextureImage::decoded(&png[..40], PictureKind::Numbers).is_err());
    }

    #[test]
    fn a_picture_is_looked_up_between_its_texels_and_repeats_itself() {
        let picture = TextureImage::from_fn(2, 2, |x, y| Vec3::new(x as f32, y as f32, 0.0));
        assert_eq!(picture.at(Vec2::new(0.25, 0.75)), Vec3::ZERO);
        assert_eq!(picture.at(Vec2::new(0.75, 0.25)), Vec3::new(1.0, 1.0, 0.0));
        assert_eq!(picture.at(Vec2::new(0.5, 0.75)), Vec3::new(0.5, 0.0, 0.0));
        assert_eq!(
            picture.at(Vec2::new(-0.25, 5.25)),
            picture.at(Vec2::new(0.75, 0.25))
        );
        assert_eq!(
            TextureImage::from_fn(0, 3, |_, _| Vec3::ONE).at(Vec2::ZERO),
            Vec3::ZERO
        );
    }

    #[test]
    fn a_packed_picture_is_small_and_looks_the_same() {
        let picture = TextureImage::from_fn(600, 300, |x, _| Vec3::new(x as f32 / 600.0, 0.2, 0.5));
        for kind in [PictureKind::Colours, PictureKind::Numbers] {
            let bytes = picture.packed(kind, 256).unwrap();
            assert!(TextureImage::unpacked(&bytes, kind, 128).is_err());
            let again = TextureImage::unpacked(&bytes, kind, 256).unwrap();
            assert_eq!((again.width, again.height), (200, 100));
            for u in [0.2, 0.5, 0.8] {
                let place = Vec2::new(u, 0.5);
                let apart = (again.at(place) - picture.at(place)).abs().max_element();
                assert!(apart < 0.03, "{apart}");
            }
        }
    }

    #[test]
    fn the_part_that_is_see_through_is_known() {
        let image = image::RgbaImage::from_fn(4, 4, |x, _| image::Rgba([9, 9, 9, x as u8 * 80]));
        let mut png = Vec::new();
        image
            .write_to(&mut Cursor::new(&mut png), image::ImageFormat::Png)
            .unwrap();
        let picture = TextureImage::decoded(&png, PictureKind::Colours).unwrap();
        assert_eq!(picture.transparent_fraction(), 0.5);
    }
}
