//! A frame, or a part of it, as a network takes it, and where its answer lies on the frame.

use std::borrow::Cow;

use image::imageops::{self, FilterType};
use image::{Rgb, RgbImage};
use relit_data::geometry::Rect;

/// What is shown around a rectangle, as a share of its longer side.
const AROUND: f64 = 0.1;

/// ImageNet's mean colour, 0 to 1, which stands around a padded picture: networks that pad themselves do so with it.
pub(super) const MEAN_COLOUR: [f32; 3] = [0.485, 0.456, 0.406];

/// In which order the values stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// 1 x 3 x height x width.
    Planes,
    /// Height x width x 3.
    Pixels,
}

/// How a frame of other sides fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fit {
    /// Both sides become the network's.
    Stretched,
    /// It keeps its shape, in the upper left corner; what remains has the mean colour.
    Padded,
}

/// What a network's picture has to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct PictureForm {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) layout: Layout,
    pub(super) fit: Fit,
    /// Taken from the colours, 0 to 1.
    pub(super) mean: [f32; 3],
    /// They are divided by it.
    pub(super) deviation: [f32; 3],
}

/// The part of a frame that a network sees, on its picture: a place of the frame is at `(place - origin) * scale`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Placement {
    pub(super) origin: [f64; 2],
    pub(super) scale: [f64; 2],
}

impl Placement {
    /// Where a place of the frame is on the network's picture.
    pub(super) fn of(&self, place: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|axis| (place[axis] - self.origin[axis]) * self.scale[axis])
    }
}

impl PictureForm {
    /// The sides of what is fed.
    pub(super) fn shape(&self) -> Vec<usize> {
        match self.layout {
            Layout::Planes => vec![1, 3, self.height, self.width],
            Layout::Pixels => vec![self.height, self.width, 3],
        }
    }

    /// Width and height of what an answer covers, in pixels of the picture: a padded one is made square inside.
    pub(super) fn covered(&self) -> (usize, usize) {
        match self.fit {
            Fit::Stretched => (self.width, self.height),
            Fit::Padded => [self.width.max(self.height); 2].into(),
        }
    }

    /// The values of a part of a frame, and where they come from.
    pub(super) fn values(&self, frame: &RgbImage, part: Rect) -> (Vec<f32>, Placement) {
        let shown = crop(frame, part);
        let sides = [f64::from(shown.width()), f64::from(shown.height())];
        let own = [self.width as f64, self.height as f64];
        let mut scale = [own[0] / sides[0], own[1] / sides[1]];
        if self.fit == Fit::Padded {
            scale = [scale[0].min(scale[1]); 2];
        }
        let size = [0, 1].map(|axis| ((sides[axis] * scale[axis]).round() as u32).max(1));
        let scaled = imageops::resize(&*shown, size[0], size[1], FilterType::Triangle);
        let value = |channel: usize, x: usize, y: usize| {
            let inside = x < size[0] as usize && y < size[1] as usize;
            let level = if inside {
                f32::from(scaled.get_pixel(x as u32, y as u32).0[channel]) / 255.0
            } else {
                MEAN_COLOUR[channel]
            };
            (level - self.mean[channel]) / self.deviation[channel]
        };
        let (columns, rows) = (0..self.width, 0..self.height);
        let values = match self.layout {
            Layout::Planes => {
                let places = (0..3).flat_map(|channel| {
                    let columns = columns.clone();
                    rows.clone()
                        .flat_map(move |y| columns.clone().map(move |x| (channel, x, y)))
                });
                places.map(|(channel, x, y)| value(channel, x, y)).collect()
            }
            Layout::Pixels => {
                let places = rows.flat_map(|y| columns.clone().map(move |x| (x, y)));
                let pixels =
                    places.flat_map(|(x, y)| [0, 1, 2].map(|channel| value(channel, x, y)));
                pixels.collect()
            }
        };
        let origin = [f64::from(part.x), f64::from(part.y)];
        (values, Placement { origin, scale })
    }
}

fn crop(frame: &RgbImage, part: Rect) -> Cow<'_, RgbImage> {
    if (part.w, part.h) == frame.dimensions() {
        return Cow::Borrowed(frame);
    }
    let pixel = |x, y| -> Rgb<u8> { *frame.get_pixel(part.x as u32 + x, part.y as u32 + y) };
    Cow::Owned(RgbImage::from_fn(part.w, part.h, pixel))
}

/// The part of a frame that shows a rectangle with something around it, or all of the frame.
pub(super) fn part_around(rect: Option<Rect>, (width, height): (u32, u32)) -> Rect {
    let whole = Rect::new(0, 0, width, height);
    let grown = rect.map(|rect| {
        let margin = (AROUND * f64::from(rect.w.max(rect.h))).ceil();
        let (left, above) = (f64::from(rect.x) - margin, f64::from(rect.y) - margin);
        let (right, below) = (rect.right() as f64 + margin, rect.bottom() as f64 + margin);
        let (left, above) = (left.max(0.0), above.max(0.0));
        let (right, below) = (right.min(f64::from(width)), below.min(f64::from(height)));
        let sides = [right - left, below - above].map(|side| side.max(0.0) as u32);
        Rect::new(left as i32, above as i32, sides[0], sides[1])
    });
    grown
        .filter(|grown| grown.w > 0 && grown.h > 0)
        .unwrap_or(whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn form(layout: Layout, fit: Fit) -> PictureForm {
        PictureForm {
            width: 8,
            height: 8,
            layout,
            fit,
            mean: [0.5; 3],
            deviation: [0.25; 3],
        }
    }

    fn frame() -> RgbImage {
        RgbImage::from_fn(16, 8, |x, _| {
            Rgb(if x < 8 { [255, 0, 0] } else { [0, 0, 255] })
        })
    }

    #[test]
    fn a_stretched_picture_has_its_colours_normalised_channel_by_channel() {
        let whole = Rect::new(0, 0, 16, 8);
        let (values, placement) = form(Layout::Planes, Fit::Stretched).values(&frame(), whole);
        assert_eq!(values.len(), 3 * 64);
        assert_eq!((values[0], values[7]), (2.0, -2.0));
        assert_eq!((values[64], values[128], values[135]), (-2.0, -2.0, 2.0));
        assert_eq!(placement.of([16.0, 8.0]), [8.0, 8.0]);
    }

    #[test]
    fn a_padded_picture_keeps_its_shape_in_the_corner() {
        let whole = Rect::new(0, 0, 16, 8);
        let (values, placement) = form(Layout::Planes, Fit::Padded).values(&frame(), whole);
        assert_eq!((values[0], values[3 * 8]), (2.0, 2.0));
        assert_eq!(values[4 * 8], (MEAN_COLOUR[0] - 0.5) / 0.25);
        assert_eq!(placement.of([16.0, 8.0]), [8.0, 4.0]);
    }

    #[test]
    fn pixels_have_their_channels_together() {
        let part = Rect::new(8, 0, 8, 8);
        let (values, placement) = form(Layout::Pixels, Fit::Stretched).values(&frame(), part);
        assert_eq!(&values[..6], [-2.0, -2.0, 2.0, -2.0, -2.0, 2.0]);
        assert_eq!(placement.of([8.0, 0.0]), [0.0, 0.0]);
    }

    #[test]
    fn the_part_around_a_rectangle_stays_in_the_frame() {
        let part = part_around(Some(Rect::new(-5, 30, 40, 100)), (200, 120));
        assert_eq!(part, Rect::new(0, 20, 45, 100));
        let whole = Rect::new(0, 0, 200, 120);
        assert_eq!(part_around(None, (200, 120)), whole);
        assert_eq!(
            part_around(Some(Rect::new(900, 900, 5, 5)), (200, 120)),
            whole
        );
    }
}
