//! Hints from a person where the object is: a rectangle, seeds, or both.

use std::io::Cursor;

use image::{DynamicImage, GrayImage, ImageFormat, ImageReader, RgbaImage};

use relit_data::geometry::Rect;

use super::error::SeedsFault;
use super::{MaskError, encode};

/// A pixel marks the object if all its channels are at least this.
const OBJECT_FROM: u8 = 250;
/// A pixel marks the background if all its channels are at most this.
const BACKGROUND_TO: u8 = 5;
/// A pixel with a smaller alpha is unknown, whatever its colour.
const OPAQUE_FROM: u8 = 128;
/// A larger spread of the channels is a colour, a smaller one the grey of a soft brush.
const COLOURED_FROM: u8 = 16;

/// What the seeds say about a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Mark {
    /// It is background.
    Background,
    /// GrabCut decides.
    Unknown,
    /// It is object.
    Object,
}

impl Mark {
    fn of(pixel: [u8; 4]) -> Self {
        let [r, g, b, alpha] = pixel;
        if alpha < OPAQUE_FROM {
            Self::Unknown
        } else if r.min(g).min(b) >= OBJECT_FROM {
            Self::Object
        } else if r.max(g).max(b) <= BACKGROUND_TO {
            Self::Background
        } else {
            Self::Unknown
        }
    }

    fn level(self) -> u8 {
        match self {
            Self::Background => 0,
            Self::Unknown => 128,
            Self::Object => 255,
        }
    }

    fn from_level(level: u8) -> Result<Self, SeedsFault> {
        match level {
            0 => Ok(Self::Background),
            128 => Ok(Self::Unknown),
            255 => Ok(Self::Object),
            other => Err(SeedsFault::Level(other)),
        }
    }
}

/// A mark for each pixel of a frame, at least one of them not [`Mark::Unknown`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds {
    width: u32,
    height: u32,
    marks: Vec<Mark>,
    coloured_px: u64,
}

impl Seeds {
    /// Reads the marks of a painted image: white (all channels >= 250) is object, black (all <= 5) is
    /// background, everything else and what is more than half transparent is unknown.
    ///
    /// # Errors
    /// [`SeedsFault::WithoutMark`].
    pub fn from_image(image: &DynamicImage) -> Result<Self, SeedsFault> {
        let painted = image.to_rgba8();
        let marks = painted.pixels().map(|pixel| Mark::of(pixel.0)).collect();
        let coloured_px = count_coloured(&painted);
        Self::new(painted.dimensions(), marks, coloured_px)
    }

    /// [`Self::from_image`] on the bytes of a PNG file of any colour type and depth.
    ///
    /// # Errors
    /// Any [`SeedsFault`] but [`SeedsFault::Level`].
    pub fn from_png(bytes: &[u8]) -> Result<Self, SeedsFault> {
        Self::from_image(&decode_png(bytes)?)
    }

    /// Width and height, pixels.
    #[must_use]
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// True if at least one pixel marks the object.
    #[must_use]
    pub fn mark_the_object(&self) -> bool {
        self.marks.contains(&Mark::Object)
    }

    /// The marks, row by row, `width * height` of them.
    #[must_use]
    pub fn marks(&self) -> &[Mark] {
        &self.marks
    }

    /// Number of pixels of the painted image that had a colour and therefore count as unknown.
    #[must_use]
    pub fn coloured_px(&self) -> u64 {
        self.coloured_px
    }

    /// The marks as a grey PNG: 255 object, 0 background, 128 unknown.
    ///
    /// # Errors
    /// [`MaskError::Encode`].
    pub fn to_marks_png(&self) -> Result<Vec<u8>, MaskError> {
        let levels = self.marks.iter().map(|mark| mark.level()).collect();
        let image = GrayImage::from_raw(self.width, self.height, levels).unwrap_or_default();
        encode::grey_png(&image, "the seeds")
    }

    /// Reads what [`Self::to_marks_png`] wrote, exactly: another grey level is an error.
    ///
    /// # Errors
    /// Any [`SeedsFault`].
    pub fn from_marks_png(bytes: &[u8], coloured_px: u64) -> Result<Self, SeedsFault> {
        let levels = decode_png(bytes)?.to_luma8();
        let marks = levels.pixels().map(|pixel| Mark::from_level(pixel.0[0]));
        let marks = marks.collect::<Result<_, _>>()?;
        Self::new(levels.dimensions(), marks, coloured_px)
    }

    pub(super) fn new(
        size: (u32, u32),
        marks: Vec<Mark>,
        coloured_px: u64,
    ) -> Result<Self, SeedsFault> {
        if marks.iter().all(|&mark| mark == Mark::Unknown) {
            return Err(SeedsFault::WithoutMark);
        }
        Ok(Self {
            width: size.0,
            height: size.1,
            marks,
            coloured_px,
        })
    }
}

fn decode_png(bytes: &[u8]) -> Result<DynamicImage, SeedsFault> {
    let reader = ImageReader::new(Cursor::new(bytes))
        .with_guessed_format()
        .map_err(|error| SeedsFault::Damaged(error.into()))?;
    if reader.format() != Some(ImageFormat::Png) {
        return Err(SeedsFault::NotPng);
    }
    reader.decode().map_err(SeedsFault::Damaged)
}

fn count_coloured(painted: &RgbaImage) -> u64 {
    let coloured = |pixel: &&image::Rgba<u8>| {
        let [r, g, b, alpha] = pixel.0;
        let spread = r.max(g).max(b) - r.min(g).min(b);
        alpha >= OPAQUE_FROM && spread > COLOURED_FROM && Mark::of(pixel.0) == Mark::Unknown
    };
    painted.pixels().filter(coloured).count() as u64
}

/// Hints from a person where the object is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Hints {
    /// The whole object is inside the rectangle.
    Rect(Rect),
    /// Parts of the object are marked, and preferably parts of the background too.
    Seeds(Seeds),
    /// A rectangle, and marks that overrule it; background marks alone are enough.
    Both {
        /// The rectangle.
        rect: Rect,
        /// The marks.
        seeds: Seeds,
    },
}

impl Hints {
    /// The hints from a rectangle, seeds, or both.
    ///
    /// # Errors
    /// [`MaskError::NoHints`] without either, [`MaskError::NothingMarked`] for seeds without rectangle that
    /// mark no object.
    pub fn from_parts(rect: Option<Rect>, seeds: Option<Seeds>) -> Result<Self, MaskError> {
        match (rect, seeds) {
            (None, None) => Err(MaskError::NoHints),
            (Some(rect), None) => Ok(Self::Rect(rect)),
            (None, Some(seeds)) if !seeds.mark_the_object() => Err(MaskError::NothingMarked),
            (None, Some(seeds)) => Ok(Self::Seeds(seeds)),
            (Some(rect), Some(seeds)) => Ok(Self::Both { rect, seeds }),
        }
    }

    /// The rectangle, as given.
    #[must_use]
    pub fn rect(&self) -> Option<Rect> {
        match self {
            Self::Rect(rect) | Self::Both { rect, .. } => Some(*rect),
            Self::Seeds(_) => None,
        }
    }

    /// The hints without what the seeds mark as object; none where nothing is left.
    pub(super) fn without_object_marks(&self) -> Option<Self> {
        let background = self.seeds().and_then(|seeds| {
            let keep = |&mark: &Mark| match mark {
                Mark::Object => Mark::Unknown,
                other => other,
            };
            let marks = seeds.marks.iter().map(keep).collect();
            Seeds::new(seeds.size(), marks, seeds.coloured_px).ok()
        });
        match (self.rect(), background) {
            (Some(rect), Some(seeds)) => Some(Self::Both { rect, seeds }),
            (Some(rect), None) => Some(Self::Rect(rect)),
            (None, seeds) => seeds.map(Self::Seeds),
        }
    }

    /// The seeds.
    #[must_use]
    pub fn seeds(&self) -> Option<&Seeds> {
        match self {
            Self::Seeds(seeds) | Self::Both { seeds, .. } => Some(seeds),
            Self::Rect(_) => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use image::{ImageBuffer, Luma, Rgb, Rgba};

    use super::*;

    fn png(image: impl Into<DynamicImage>) -> Vec<u8> {
        let mut bytes = Cursor::new(Vec::new());
        let image: DynamicImage = image.into();
        image.write_to(&mut bytes, ImageFormat::Png).unwrap();
        bytes.into_inner()
    }

    #[test]
    fn white_black_and_the_rest_are_distinguished() {
        let pixels = [
            [255, 250, 251, 255],
            [0, 5, 3, 255],
            [128, 128, 128, 255],
            [255, 255, 255, 127],
            [0, 0, 0, 0],
            [255, 0, 0, 255],
        ];
        let image = RgbaImage::from_fn(6, 1, |x, _| Rgba(pixels[x as usize]));
        let seeds = Seeds::from_png(&png(image)).unwrap();
        use Mark::{Background, Object, Unknown};
        let wanted = [Object, Background, Unknown, Unknown, Unknown, Unknown];
        assert_eq!(seeds.marks(), wanted);
        assert_eq!(seeds.coloured_px(), 1);
    }

    #[test]
    fn grey_and_16_bit_images_are_accepted() {
        let grey = ImageBuffer::from_fn(3, 1, |x, _| Luma([[0u8, 128, 255][x as usize]]));
        let deep = ImageBuffer::from_fn(3, 1, |x, _| Luma([[0u16, 30000, 65535][x as usize]]));
        let grey = Seeds::from_png(&png(grey)).unwrap();
        assert_eq!(grey, Seeds::from_png(&png(deep)).unwrap());
        assert_eq!(
            grey.marks(),
            [Mark::Background, Mark::Unknown, Mark::Object]
        );
    }

    #[test]
    fn palette_images_are_accepted() {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(png::ColorType::Indexed);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.set_palette(vec![0, 0, 0, 255, 255, 255]);
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&[1, 0]).unwrap();
        writer.finish().unwrap();
        let seeds = Seeds::from_png(&bytes).unwrap();
        assert_eq!(seeds.marks(), [Mark::Object, Mark::Background]);
    }

    #[test]
    fn seeds_without_object_are_accepted_only_with_a_rectangle() {
        let grey = ImageBuffer::from_pixel(4, 4, Rgb([128u8, 128, 128]));
        let unmarked = Seeds::from_png(&png(grey));
        assert!(matches!(unmarked, Err(SeedsFault::WithoutMark)));
        let black = ImageBuffer::from_pixel(4, 4, Rgb([0u8, 0, 0]));
        let seeds = Seeds::from_png(&png(black)).unwrap();
        let alone = Hints::from_parts(None, Some(seeds.clone()));
        assert!(matches!(alone, Err(MaskError::NothingMarked)));
        assert!(Hints::from_parts(Some(Rect::new(0, 0, 2, 2)), Some(seeds)).is_ok());
    }

    #[test]
    fn what_is_not_a_png_is_refused() {
        assert!(matches!(Seeds::from_png(b""), Err(SeedsFault::NotPng)));
        let jpeg = [0xff, 0xd8, 0xff, 0xe0, 0, 0];
        assert!(matches!(Seeds::from_png(&jpeg), Err(SeedsFault::NotPng)));
        let white = ImageBuffer::from_pixel(9, 9, Luma([255u8]));
        let cut = &png(white)[..40];
        assert!(matches!(Seeds::from_png(cut), Err(SeedsFault::Damaged(_))));
    }

    #[test]
    fn recorded_seeds_come_back_as_they_were() {
        let image =
            ImageBuffer::from_fn(7, 3, |x, y| Luma([[0u8, 128, 255][(x + y) as usize % 3]]));
        let seeds = Seeds::from_image(&image.into()).unwrap();
        let bytes = seeds.to_marks_png().unwrap();
        assert_eq!(Seeds::from_marks_png(&bytes, 0).unwrap(), seeds);
        let other = png(ImageBuffer::from_pixel(2, 2, Luma([77u8])));
        let result = Seeds::from_marks_png(&other, 0);
        assert!(matches!(result, Err(SeedsFault::Level(77))));
    }
}
