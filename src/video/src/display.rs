//! How coded pixels become a picture as it is displayed: pixels that are not square are stretched, then the picture is turned.
//! All decoders use this module.

use ffmpeg_next::codec::packet;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::format::stream::Stream;
use ffmpeg_next::frame::{self, side_data};
use ffmpeg_next::{Rational, ffi};
use image::RgbImage;
use image::metadata::Orientation as Exif;
use relit_data::geometry::Rect;

use super::orientation::Orientation;
use super::photograph::is_photograph;

/// The most by which pixels are stretched; a larger ratio is a mistake of the file.
const MAX_STRETCH: f64 = 8.0;

/// From coded pixels to the displayed picture.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Display {
    orientation: Orientation,
    /// Width and height of a pixel, in lowest terms; `None` if it is square.
    pixel: Option<(u32, u32)>,
}

impl Display {
    /// What a stream says about its pictures, or the first of them, which counts more; and remarks about it.
    pub(super) fn from_frame(
        input: &Input,
        stream: &Stream<'_>,
        picture: Option<&frame::Video>,
        exif: Option<Exif>,
    ) -> (Self, Vec<String>) {
        let mut notes = Vec::new();
        let orientation = match exif {
            Some(exif) => Orientation::from_exif(exif),
            None => match display_matrix(stream, picture) {
                None => Orientation::default(),
                Some(matrix) => Orientation::from_display_matrix(&matrix).unwrap_or_else(|| {
                    let note = "the file asks for a rotation that is not a multiple of 90 degrees, which is ignored";
                    notes.push(note.to_owned());
                    Orientation::default()
                }),
            },
        };
        // A photograph's ratio is the resolution for printing.
        let ratio = if is_photograph(input) {
            Rational::new(1, 1)
        } else {
            pixel_ratio(input, stream, picture)
        };
        let pixel = pixel_shape(ratio);
        if pixel.is_none() && ratio.numerator() > 0 && ratio.numerator() != ratio.denominator() {
            notes.push(format!(
                "the file says that its pixels are {} x {} units in size; they are treated as square",
                ratio.numerator(),
                ratio.denominator()
            ));
        }
        let display = Self { orientation, pixel };
        (display, notes)
    }

    /// Whether coded pixels are displayed as they are.
    pub(super) fn is_plain(self) -> bool {
        self == Self::default()
    }

    /// Width and height as displayed, of a picture coded with these.
    pub(super) fn displayed(self, width: u32, height: u32) -> (u32, u32) {
        let (width, height) = self.square(width, height);
        self.orientation.displayed(width, height)
    }

    /// As [`Self::displayed`], in pixels as they are stored.
    pub(super) fn stored(self, width: u32, height: u32) -> (u32, u32) {
        self.orientation.displayed(width, height)
    }

    /// That pixels are not square, as a remark for the user.
    pub(super) fn note(self, width: u32, height: u32) -> Option<String> {
        let (w, h) = self.pixel?;
        let (stored, shown) = (self.stored(width, height), self.displayed(width, height));
        Some(format!(
            "its pixels are not square ({w}:{h}): its frames of {} x {} are shown as {} x {}, as players do",
            stored.0, stored.1, shown.0, shown.1
        ))
    }

    /// Width and height in square pixels, before the picture is turned: one of them grows, so that nothing is lost.
    fn square(self, width: u32, height: u32) -> (u32, u32) {
        let grown = |size: u32, by: u32, over: u32| {
            let grown =
                (2 * u64::from(size) * u64::from(by) + u64::from(over)) / (2 * u64::from(over));
            u32::try_from(grown).unwrap_or(u32::MAX).max(1)
        };
        match self.pixel {
            Some((w, h)) if w > h => (grown(width, w, h), height),
            Some((w, h)) => (width, grown(height, h, w)),
            None => (width, height),
        }
    }

    /// The part of a displayed picture under `rect`, which lies inside it. `coded` gives a part of the picture as it is
    /// coded, whose size is given.
    pub(super) fn part<E>(
        self,
        rect: Rect,
        (width, height): (u32, u32),
        coded: impl Fn(Rect) -> Result<RgbImage, E>,
    ) -> Result<RgbImage, E> {
        let (square_w, square_h) = self.square(width, height);
        let rect = self.orientation.to_coded(rect, square_w, square_h);
        let across = Stretch::new((rect.x, rect.w), width, square_w);
        let down = Stretch::new((rect.y, rect.h), height, square_h);
        let needed = Rect::new(across.first, down.first, across.size, down.size);
        let part = coded(needed)?;
        let part = if square_w == width {
            part
        } else {
            across.columns(&part)
        };
        let part = if square_h == height {
            part
        } else {
            down.rows(&part)
        };
        Ok(self.orientation.apply(part))
    }
}

/// Linear interpolation along one axis, of `w` positions from `x` on.
struct Stretch {
    /// The first sample that is needed, and how many are.
    first: i32,
    size: u32,
    /// For each position the sample before it, from the first on, and the weight of the one behind, of 256.
    taps: Vec<(u32, u32)>,
}

impl Stretch {
    fn new((x, w): (i32, u32), samples: u32, positions: u32) -> Self {
        let last = i64::from(samples) - 1;
        let (from, to) = (i64::from(samples), i64::from(positions).max(1));
        let place = |at: u32| {
            // The middle of the position, in 256ths of a sample from the middle of the first.
            let middle = 2 * (i64::from(x) + i64::from(at)) + 1;
            let place = (128 * middle * from).div_euclid(to) - 128;
            place.clamp(0, 256 * last)
        };
        let first = place(0) / 256;
        let end = (place(w.saturating_sub(1)) + 255) / 256;
        let taps = (0..w).map(|at| {
            let place = place(at);
            ((place / 256 - first) as u32, (place % 256) as u32)
        });
        Self {
            first: first as i32,
            size: (end - first + 1) as u32,
            taps: taps.collect(),
        }
    }

    fn columns(&self, part: &RgbImage) -> RgbImage {
        RgbImage::from_fn(self.taps.len() as u32, part.height(), |x, y| {
            let (at, weight) = self.taps[x as usize];
            let next = (at + 1).min(part.width() - 1);
            blend(part.get_pixel(at, y), part.get_pixel(next, y), weight)
        })
    }

    fn rows(&self, part: &RgbImage) -> RgbImage {
        RgbImage::from_fn(part.width(), self.taps.len() as u32, |x, y| {
            let (at, weight) = self.taps[y as usize];
            let next = (at + 1).min(part.height() - 1);
            blend(part.get_pixel(x, at), part.get_pixel(x, next), weight)
        })
    }
}

fn blend(a: &image::Rgb<u8>, b: &image::Rgb<u8>, weight: u32) -> image::Rgb<u8> {
    image::Rgb([0, 1, 2].map(|channel| {
        let (a, b) = (u32::from(a.0[channel]), u32::from(b.0[channel]));
        ((a * (256 - weight) + b * weight + 128) / 256) as u8
    }))
}

/// FFmpeg's display matrix: that of the picture (H.264's and HEVC's messages, Exif in Motion JPEG), else the stream's.
fn display_matrix(stream: &Stream<'_>, picture: Option<&frame::Video>) -> Option<Vec<u8>> {
    let of_picture = picture.and_then(|picture| picture.side_data(side_data::Type::DisplayMatrix));
    if let Some(matrix) = of_picture {
        return Some(matrix.data().to_vec());
    }
    let mut side_data = stream.side_data();
    let matrix = side_data.find(|data| data.kind() == packet::side_data::Type::DisplayMatrix);
    matrix.map(|matrix| matrix.data().to_vec())
}

/// Width over height of a pixel: the container's, else the picture's, as FFmpeg chooses.
#[allow(unsafe_code)]
fn pixel_ratio(input: &Input, stream: &Stream<'_>, picture: Option<&frame::Video>) -> Rational {
    let frame = picture.map_or(std::ptr::null(), |picture| {
        // SAFETY: the pointer is that of a live frame.
        unsafe { picture.as_ptr() }
    });
    // SAFETY: the function reads plain numbers of a live input, one of its streams and a live frame or null; its
    // parameters are mutable for historical reasons alone.
    let ratio = unsafe {
        ffi::av_guess_sample_aspect_ratio(
            input.as_ptr().cast_mut(),
            stream.as_ptr().cast_mut(),
            frame.cast_mut(),
        )
    };
    Rational::from(ratio)
}

/// Width and height of a pixel in lowest terms; `None` if it is square, or not known.
fn pixel_shape(ratio: Rational) -> Option<(u32, u32)> {
    let (width, height) = (ratio.numerator(), ratio.denominator());
    let (width, height) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
    let stretch = f64::from(width.max(height)) / f64::from(width.min(height));
    let divisor = gcd(width, height).max(1);
    let shape = (width / divisor, height / divisor);
    (width > 0 && height > 0 && width != height && stretch <= MAX_STRETCH).then_some(shape)
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use image::Rgb;
    use image::imageops::crop_imm;

    use super::*;

    fn display(pixel: (u32, u32), orientation: Orientation) -> Display {
        let pixel = pixel_shape(Rational::new(pixel.0 as i32, pixel.1 as i32));
        Display { orientation, pixel }
    }

    fn whole(by: Display, coded: &RgbImage) -> RgbImage {
        let (w, h) = by.displayed(coded.width(), coded.height());
        part(by, coded, Rect::new(0, 0, w, h))
    }

    fn part(by: Display, coded: &RgbImage, rect: Rect) -> RgbImage {
        let cut = |r: Rect| {
            let within = r.clipped_to(coded.width(), coded.height());
            assert_eq!(within, Some(r));
            Ok::<_, Infallible>(crop_imm(coded, r.x as u32, r.y as u32, r.w, r.h).to_image())
        };
        by.part(rect, coded.dimensions(), cut).unwrap()
    }

    #[test]
    fn pixels_grow_to_squares_and_never_shrink() {
        let upright = Orientation::default();
        for (pixel, wanted) in [
            ((4, 3), (213, 120)),
            ((3, 4), (160, 160)),
            ((1, 1), (160, 120)),
            ((0, 1), (160, 120)),
            ((5, 0), (160, 120)),
            ((100, 1), (160, 120)),
            ((16, 15), (171, 120)),
        ] {
            assert_eq!(
                display(pixel, upright).displayed(160, 120),
                wanted,
                "{pixel:?}"
            );
        }
        let turned = Orientation::from_exif(Exif::Rotate90);
        assert_eq!(display((4, 3), turned).displayed(160, 120), (120, 213));
    }

    #[test]
    fn a_gradient_stays_one() {
        let coded = RgbImage::from_fn(40, 4, |x, _| Rgb([6 * x as u8; 3]));
        let shown = whole(display((3, 2), Orientation::default()), &coded);
        assert_eq!(shown.dimensions(), (60, 4));
        for x in 2..58 {
            let wanted = 6.0 * ((f64::from(x) + 0.5) * 40.0 / 60.0 - 0.5);
            let found = f64::from(shown.get_pixel(x, 1).0[0]);
            assert!((found - wanted).abs() <= 1.0, "{x}: {found} {wanted}");
        }
    }

    #[test]
    fn a_part_is_cut_from_the_whole_wherever_it_begins() {
        let coded = RgbImage::from_fn(37, 23, |x, y| {
            Rgb([(x * 7) as u8, (y * 11) as u8, (x * y) as u8])
        });
        for exif in (1..=8).filter_map(Exif::from_exif) {
            for pixel in [(4, 3), (10, 11), (1, 1), (2, 1)] {
                let by = display(pixel, Orientation::from_exif(exif));
                let shown = whole(by, &coded);
                for rect in [
                    Rect::new(3, 5, 7, 6),
                    Rect::new(0, 0, 1, 1),
                    Rect::new(9, 2, 11, 20),
                ] {
                    let wanted = crop_imm(&shown, rect.x as u32, rect.y as u32, rect.w, rect.h);
                    assert!(part(by, &coded, rect) == wanted.to_image(), "{by:?} {rect}");
                }
            }
        }
    }
}
