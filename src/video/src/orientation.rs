//! Rotation and mirroring for display: the display matrix of MP4 and Matroska, and Exif's orientation.

use image::RgbImage;
use image::imageops::{flip_horizontal_in_place, flip_vertical_in_place};
use image::metadata::Orientation as Exif;

use relit_data::geometry::Rect;

/// One of the eight orientations of a picture: first transposed, then flipped.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct Orientation {
    /// Rows become columns.
    transpose: bool,
    /// Then left and right are swapped.
    flip_x: bool,
    /// Then top and bottom are swapped.
    flip_y: bool,
}

impl Orientation {
    /// Reads FFmpeg's display matrix: nine 32-bit integers in the machine's byte order;
    /// the four of the 2 x 2 part are 16.16 fixed point; (x', y') = (a x + c y, b x + d y).
    /// `None` where it is not a turn by a multiple of 90 degrees.
    pub(super) fn from_display_matrix(bytes: &[u8]) -> Option<Self> {
        let entry = |at: usize| -> Option<i32> {
            let raw = bytes.get(4 * at..4 * at + 4)?;
            Some(i32::from_ne_bytes(raw.try_into().ok()?))
        };
        let (a, b, c, d) = (entry(0)?, entry(1)?, entry(3)?, entry(4)?);
        match (a != 0, b != 0, c != 0, d != 0) {
            (true, false, false, true) => Some(Self {
                transpose: false,
                flip_x: a < 0,
                flip_y: d < 0,
            }),
            (false, true, true, false) => Some(Self {
                transpose: true,
                flip_x: c < 0,
                flip_y: b < 0,
            }),
            _ => None,
        }
    }

    /// What Exif asks for.
    pub(super) const fn from_exif(exif: Exif) -> Self {
        let (transpose, flip_x, flip_y) = match exif {
            Exif::NoTransforms => (false, false, false),
            Exif::FlipHorizontal => (false, true, false),
            Exif::Rotate180 => (false, true, true),
            Exif::FlipVertical => (false, false, true),
            Exif::Rotate90FlipH => (true, false, false),
            Exif::Rotate90 => (true, true, false),
            Exif::Rotate270FlipH => (true, true, true),
            Exif::Rotate270 => (true, false, true),
        };
        Self {
            transpose,
            flip_x,
            flip_y,
        }
    }

    /// Width and height as displayed, of a picture coded with these.
    pub(super) fn displayed(self, width: u32, height: u32) -> (u32, u32) {
        if self.transpose {
            (height, width)
        } else {
            (width, height)
        }
    }

    /// Where a rectangle of the displayed picture lies in the coded one, whose size is given.
    pub(super) fn to_coded(self, rect: Rect, width: u32, height: u32) -> Rect {
        let (shown_w, shown_h) = self.displayed(width, height);
        let mirrored = |at: i32, extent: u32, whole: u32| {
            (i64::from(whole) - i64::from(at) - i64::from(extent)) as i32
        };
        let x = if self.flip_x {
            mirrored(rect.x, rect.w, shown_w)
        } else {
            rect.x
        };
        let y = if self.flip_y {
            mirrored(rect.y, rect.h, shown_h)
        } else {
            rect.y
        };
        if self.transpose {
            Rect::new(y, x, rect.h, rect.w)
        } else {
            Rect::new(x, y, rect.w, rect.h)
        }
    }

    /// Turns a region of a coded picture for display.
    pub(super) fn apply(self, coded: RgbImage) -> RgbImage {
        let mut shown = if self.transpose {
            RgbImage::from_fn(coded.height(), coded.width(), |x, y| *coded.get_pixel(y, x))
        } else {
            coded
        };
        if self.flip_x {
            flip_horizontal_in_place(&mut shown);
        }
        if self.flip_y {
            flip_vertical_in_place(&mut shown);
        }
        shown
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: i32 = 1 << 16;

    fn matrix(a: i32, b: i32, c: i32, d: i32) -> Vec<u8> {
        [a, b, 0, c, d, 0, 0, 0, 1 << 30]
            .into_iter()
            .flat_map(i32::to_ne_bytes)
            .collect()
    }

    fn numbered(width: u32, height: u32) -> RgbImage {
        RgbImage::from_fn(width, height, |x, y| image::Rgb([x as u8, y as u8, 0]))
    }

    fn all_eight() -> impl Iterator<Item = Orientation> {
        (0..8).map(|bits| Orientation {
            transpose: bits & 1 != 0,
            flip_x: bits & 2 != 0,
            flip_y: bits & 4 != 0,
        })
    }

    #[test]
    fn a_quarter_turn_clockwise_moves_the_upper_left_to_the_upper_right() {
        // x' = -y, y' = x: what a phone held upright writes.
        let turn = Orientation::from_display_matrix(&matrix(0, ONE, -ONE, 0)).unwrap();
        let shown = turn.apply(numbered(4, 3));
        assert_eq!(shown.dimensions(), (3, 4));
        assert_eq!(shown.get_pixel(2, 0).0, [0, 0, 0]);
        assert_eq!(shown.get_pixel(2, 3).0, [3, 0, 0]);
    }

    #[test]
    fn exif_turns_a_picture_as_the_crate_image_does() {
        for number in 1..=8 {
            let exif = Exif::from_exif(number).unwrap();
            let mut wanted = image::DynamicImage::from(numbered(4, 3));
            wanted.apply_orientation(exif);
            let shown = Orientation::from_exif(exif).apply(numbered(4, 3));
            assert_eq!(shown, wanted.into_rgb8(), "{number}");
        }
    }

    #[test]
    fn other_angles_and_short_data_are_refused() {
        assert_eq!(
            Orientation::from_display_matrix(&matrix(ONE, ONE, -ONE, ONE)),
            None
        );
        assert_eq!(Orientation::from_display_matrix(&[0; 8]), None);
    }

    #[test]
    fn a_piece_turned_alone_is_the_piece_of_the_turned_whole() {
        let coded = numbered(7, 5);
        for turn in all_eight() {
            let whole = turn.apply(coded.clone());
            let rect = Rect::new(1, 2, 3, 2);
            let r = turn.to_coded(rect, 7, 5);
            let piece =
                image::imageops::crop_imm(&coded, r.x as u32, r.y as u32, r.w, r.h).to_image();
            let wanted = image::imageops::crop_imm(&whole, 1, 2, rect.w, rect.h).to_image();
            assert_eq!(turn.apply(piece), wanted, "{turn:?}");
        }
    }
}
