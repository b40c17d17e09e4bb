//! Hints from a person where the object is: a rectangle, painted seeds, and strokes over both.

use std::borrow::Cow;
use std::io::Cursor;

use image::{DynamicImage, GrayImage, ImageFormat, ImageReader, RgbaImage};

use relit_data::geometry::Rect;

use crate::{MaskError, Strokes, grey_png};

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
    fn from_pixel(pixel: [u8; 4]) -> Self {
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
    /// [`MaskError::Hints`] without any mark.
    pub fn from_image(image: &DynamicImage) -> Result<Self, MaskError> {
        let painted = image.to_rgba8();
        let marks = painted
            .pixels()
            .map(|pixel| Mark::from_pixel(pixel.0))
            .collect();
        let coloured_px = count_coloured(&painted);
        Self::new(painted.dimensions(), marks, coloured_px)
    }

    /// [`Self::from_image`] on the bytes of a PNG file of any colour type and depth.
    ///
    /// # Errors
    /// [`MaskError::Hints`].
    pub fn from_png(bytes: &[u8]) -> Result<Self, MaskError> {
        Self::from_image(&decode_png(bytes)?)
    }

    /// Width and height, pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.width, self.height)
    }

    /// The marks, row by row, `width * height` of them.
    pub fn marks(&self) -> &[Mark] {
        &self.marks
    }

    /// Number of pixels of the painted image that had a colour and therefore count as unknown.
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
        grey_png(&image, "the seeds")
    }

    /// Reads what [`Self::to_marks_png`] wrote.
    ///
    /// # Errors
    /// [`MaskError::Hints`].
    pub fn from_marks_png(bytes: &[u8], coloured_px: u64) -> Result<Self, MaskError> {
        Ok(Self {
            coloured_px,
            ..Self::from_png(bytes)?
        })
    }

    pub(crate) fn new(
        size: (u32, u32),
        marks: Vec<Mark>,
        coloured_px: u64,
    ) -> Result<Self, MaskError> {
        if marks.iter().all(|&mark| mark == Mark::Unknown) {
            let why = "no pixel of it is white (object) or black (background): paint with a hard brush, nearly white is unknown";
            return Err(MaskError::Hints(why.to_owned()));
        }
        Ok(Self {
            width: size.0,
            height: size.1,
            marks,
            coloured_px,
        })
    }
}

/// A lossy format would blur the marks.
fn decode_png(bytes: &[u8]) -> Result<DynamicImage, MaskError> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let png = reader
        .ok()
        .filter(|reader| reader.format() == Some(ImageFormat::Png));
    let Some(png) = png else {
        let why = "it is not a PNG file; save the seeds as PNG";
        return Err(MaskError::Hints(why.to_owned()));
    };
    png.decode().map_err(|error| {
        MaskError::Hints(format!(
            "it cannot be decoded as PNG ({error}); save it again"
        ))
    })
}

fn count_coloured(painted: &RgbaImage) -> u64 {
    let coloured = |pixel: &&image::Rgba<u8>| {
        let [r, g, b, alpha] = pixel.0;
        let spread = r.max(g).max(b) - r.min(g).min(b);
        alpha >= OPAQUE_FROM && spread > COLOURED_FROM && Mark::from_pixel(pixel.0) == Mark::Unknown
    };
    painted.pixels().filter(coloured).count() as u64
}

/// What a person gave to find the object by: any of these, or nothing where a turn is enough.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Hints {
    /// The whole object is inside it.
    pub rect: Option<Rect>,
    /// Parts of the object are marked, and preferably parts of the background too. They overrule the rectangle, beside
    /// which marks of the background alone are enough.
    pub seeds: Option<Seeds>,
    /// What was painted over the seeds.
    pub strokes: Strokes,
}

impl Hints {
    /// True if nothing is given.
    pub fn is_empty(&self) -> bool {
        self.rect.is_none() && self.seeds.is_none() && self.strokes.is_empty()
    }

    /// The same with the strokes painted on the seeds of a frame of `size`.
    ///
    /// # Errors
    /// As [`Strokes::paint`].
    pub fn painted(&self, size: (u32, u32)) -> Result<Cow<'_, Self>, MaskError> {
        if self.strokes.is_empty() {
            return Ok(Cow::Borrowed(self));
        }
        Ok(Cow::Owned(Self {
            rect: self.rect,
            seeds: self.strokes.paint(size, self.seeds.as_ref())?,
            strokes: Strokes::default(),
        }))
    }

    /// The marks of the seeds, none without seeds.
    pub fn marks(&self) -> &[Mark] {
        self.seeds.as_ref().map_or(&[], Seeds::marks)
    }

    /// The hints without what the seeds mark as object.
    pub(crate) fn without_object_marks(&self) -> Self {
        let background = self.seeds.as_ref().and_then(|seeds| {
            let keep = |&mark: &Mark| match mark {
                Mark::Object => Mark::Unknown,
                other => other,
            };
            let marks = seeds.marks.iter().map(keep).collect();
            Seeds::new(seeds.size(), marks, seeds.coloured_px).ok()
        });
        Self {
            seeds: background,
            ..self.clone()
        }
    }
}

impl From<Rect> for Hints {
    fn from(rect: Rect) -> Self {
        Self {
            rect: Some(rect),
            ..Self::default()
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
    fn seeds_without_any_mark_are_refused() {
        let grey = ImageBuffer::from_pixel(4, 4, Rgb([128u8, 128, 128]));
        assert!(refused(Seeds::from_png(&png(grey))).contains("white"));
    }

    #[test]
    fn what_is_not_a_png_is_refused() {
        let nothing = refused(Seeds::from_png(b""));
        assert!(nothing.contains("PNG"), "{nothing}");
        let jpeg = [0xff, 0xd8, 0xff, 0xe0, 0, 0];
        assert_eq!(refused(Seeds::from_png(&jpeg)), nothing);
        let white = ImageBuffer::from_pixel(9, 9, Luma([255u8]));
        // A PNG that is cut off is told from what is none.
        assert_ne!(refused(Seeds::from_png(&png(white)[..40])), nothing);
    }

    fn refused(seeds: Result<Seeds, MaskError>) -> String {
        match seeds {
            Err(MaskError::Hints(text)) => text,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn recorded_seeds_come_back_as_they_were() {
        let image =
            ImageBuffer::from_fn(7, 3, |x, y| Luma([[0u8, 128, 255][(x + y) as usize % 3]]));
        let seeds = Seeds::from_image(&image.into()).unwrap();
        let bytes = seeds.to_marks_png().unwrap();
        assert_eq!(Seeds::from_marks_png(&bytes, 0).unwrap(), seeds);
    }
}
