//! The square around an object, and ways between the photograph and the network's size.

use std::ops::Range;

use relight_core::image::{Extent, Part, Planes};

/// The part of the square that is left free around the object.
const MARGIN: f64 = 0.04;

/// A square of a photograph; it may reach beyond the photograph's edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct CropSquare {
    /// Column of its left edge, pixels; negative where it begins left of the photograph.
    pub x: i64,
    /// Row of its upper edge, pixels.
    pub y: i64,
    /// Width and height, pixels.
    pub side: usize,
}

impl CropSquare {
    /// The square around the pixels where the mask is at least one half, with 4 % more than their longer
    /// side; `None` without such pixels.
    pub fn around(mask: &Planes<1>) -> Option<Self> {
        let sides = mask.bounds(0.5)?;
        let longest = sides.iter().map(Range::len).max()?;
        let side = (longest as f64 * (1.0 + MARGIN)).ceil() as usize;
        let [x, y] = sides.map(|line| ((line.start + line.end) as i64 - side as i64) / 2);
        Some(Self { x, y, side })
    }

    /// Width and height.
    pub fn extent(&self) -> Extent {
        Extent::new(self.side, self.side)
    }

    /// A window of the photograph as a part of the square.
    pub(super) fn part(&self, window: &Window) -> Part {
        let [x, y] = window.at.map(|place| place as i64);
        Part {
            whole: self.extent(),
            at: [x - self.x, y - self.y],
            extent: window.extent,
        }
    }

    /// That part of a photograph in another size; 0 beyond its edges.
    pub fn resized<const C: usize>(&self, image: &Planes<C>, extent: Extent) -> Planes<C> {
        let all = Window {
            at: [0; 2],
            extent: image.extent(),
        };
        image.resized_part(&self.part(&all), &Part::all(extent))
    }
}

/// A rectangle of a photograph in which its layers are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Window {
    /// Column and row of its first pixel.
    pub(super) at: [usize; 2],
    /// Width and height.
    pub(super) extent: Extent,
}

impl Window {
    /// The smallest that holds all pixels where the mask is at least one half.
    pub(super) fn around(mask: &Planes<1>) -> Option<Self> {
        let [columns, rows] = mask.bounds(0.5)?;
        Some(Self {
            at: [columns.start, rows.start],
            extent: Extent::new(columns.len(), rows.len()),
        })
    }

    pub(super) fn cut<const C: usize>(&self, image: &Planes<C>) -> Planes<C> {
        image.cut(self.at, self.extent)
    }
}

/// A picture, 0 outside its mask, and the mask, 0 or 1, in another size: each pixel is the mean of what the mask covers
/// of its area, so that nothing of the background comes in. Both are a part of an image that is 0 elsewhere.
pub(super) fn downscaled(
    picture: &Planes<3>,
    mask: &Planes<1>,
    part: &Part,
    extent: Extent,
) -> (Planes<3>, Planes<1>) {
    let all = Part::all(extent);
    let share = mask.resized_part(part, &all);
    let most = share.plane(0).iter().fold(0.0_f32, |a, &b| a.max(b));
    // Of an object that is thinner than a pixel everywhere, every trace counts.
    let least = 0.5_f32.min(most).max(f32::MIN_POSITIVE);
    let inside = share
        .clone()
        .map(|share| f32::from(u8::from(share >= least)));
    let factors = (inside.clone()).zip(&share, |inside, share| {
        inside / share.max(f32::MIN_POSITIVE)
    });
    let sums = picture.resized_part(part, &all);
    (cut_out(sums, &factors), inside)
}

/// The image times the mask.
pub(super) fn cut_out<const C: usize>(image: Planes<C>, mask: &Planes<1>) -> Planes<C> {
    image.zip(mask, |value, mask| value * mask)
}

/// A part of the image in another size, where only what lies inside the mask counts: the values at its edge go on
/// beyond it first.
pub(super) fn enlarged<const C: usize>(
    image: &Planes<C>,
    inside: &[bool],
    part: &Part,
) -> Planes<C> {
    let everywhere = vec![true; inside.len()];
    let image = image.clone().extended(inside, &everywhere);
    image.resized_part(&Part::all(image.extent()), part)
}

/// Where a mask is at least one half.
pub(super) fn inside(mask: &Planes<1>) -> Vec<bool> {
    mask.plane(0).iter().map(|&value| value >= 0.5).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn disc(extent: Extent, [x0, y0]: [f32; 2], radius: f32) -> Planes<1> {
        Planes::from_fn(extent, |x, y| {
            let inside = (x as f32 - x0).hypot(y as f32 - y0) <= radius;
            [f32::from(u8::from(inside))]
        })
    }

    #[test]
    fn the_region_is_a_square_around_the_object_and_may_leave_the_photograph() {
        let mask = disc(Extent::new(100, 60), [10.0, 30.0], 25.0);
        let region = CropSquare::around(&mask).unwrap();
        // Columns 0 to 35, rows 5 to 55: 51 pixels, and 4 % more.
        assert_eq!(region.side, 54);
        assert_eq!((region.x, region.y), (-9, 3));
        assert_eq!(CropSquare::around(&Planes::zeros(Extent::new(9, 9))), None);
    }

    #[test]
    fn the_background_bleeds_neither_in_nor_out() {
        let extent = Extent::new(64, 64);
        let mask = disc(extent, [31.0, 31.0], 25.0);
        let picture = Planes::from_fn(extent, |x, y| {
            let value = if mask.pixel(x, y)[0] > 0.0 { 0.25 } else { 9.0 };
            [value; 3]
        });
        let picture = cut_out(picture, &mask);
        let all = Part::all(extent);
        let (small, small_mask) = downscaled(&picture, &mask, &all, Extent::new(16, 16));
        let kept = inside(&small_mask);
        for (value, &inside) in small.plane(0).iter().zip(&kept) {
            let expected = if inside { 0.25 } else { 0.0 };
            assert!((value - expected).abs() < 1e-6, "{value}");
        }
        let large = enlarged(&small, &kept, &all);
        assert!(
            large
                .plane(1)
                .iter()
                .all(|value| (value - 0.25).abs() < 1e-6)
        );
    }

    #[test]
    fn an_object_thinner_than_a_pixel_is_still_there() {
        let extent = Extent::new(64, 64);
        let mask = Planes::from_fn(extent, |x, _| [f32::from(u8::from(x == 30))]);
        let picture = cut_out(Planes::filled(extent, [0.5; 3]), &mask);
        let all = Part::all(extent);
        let (small, small_mask) = downscaled(&picture, &mask, &all, Extent::new(16, 16));
        let kept = inside(&small_mask);
        assert_eq!(kept.iter().filter(|inside| **inside).count(), 16);
        let value = small.pixel(7, 3)[0];
        assert!((value - 0.5).abs() < 1e-6, "{value}");
    }
}
