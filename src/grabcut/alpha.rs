//! How much of each pixel along the edge is object: the soft mask beside the hard one.
//!
//! A pixel of the edge mixes the colours of both sides. Each is estimated as the average of the sure pixels
//! nearby, and the share is where the pixel lies on the line between the two. Where the sides look alike
//! the line says nothing, and the hard mask, slightly blurred, counts instead.

use image::{GrayImage, RgbImage};

use super::bitmap::Bitmap;

/// Half the width of the band that is not sure, pixels.
const BAND: usize = 2;
/// Half the side of the square in which the two colours are averaged, pixels.
const REACH: usize = 7;
/// Squared colour distance at which the line counts as much as the blurred mask.
const ALIKE: f32 = 150.0;
/// A mask's pixel belongs to the object from this level on.
const OBJECT_FROM: u8 = 128;

/// The share of the object in each pixel, 0..=255, from a frame and its mask (object from 128 on): 255 and 0
/// away from the mask's edge. If the two differ in size, the mask is returned.
#[must_use]
pub fn alpha(frame: &RgbImage, mask: &GrayImage) -> GrayImage {
    let size = mask.dimensions();
    if frame.dimensions() != size {
        return mask.clone();
    }
    let object = Bitmap::new(
        size,
        mask.as_raw().iter().map(|&level| level >= OBJECT_FROM),
    );
    let near_ground = object.inverted().dilated(BAND);
    let near_object = object.dilated(BAND);
    let level = |at: usize| match (near_object.bits()[at], near_ground.bits()[at]) {
        (true, true) => mixed(frame, &object, &near_object, &near_ground, at),
        (true, false) => 255,
        _ => 0,
    };
    let levels = (0..mask.as_raw().len()).map(level).collect();
    GrayImage::from_raw(size.0, size.1, levels).unwrap_or_default()
}

/// The share in a pixel of the band.
fn mixed(
    frame: &RgbImage,
    object: &Bitmap,
    near_object: &Bitmap,
    near_ground: &Bitmap,
    at: usize,
) -> u8 {
    let width = frame.width() as usize;
    let height = frame.height() as usize;
    let (x, y) = (at % width, at / width);
    let mut inside = Average::default();
    let mut outside = Average::default();
    let (mut around, mut of_object) = (0.0, 0.0);
    for row in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
        for column in x.saturating_sub(REACH)..(x + REACH + 1).min(width) {
            let near = row * width + column;
            match (near_object.bits()[near], near_ground.bits()[near]) {
                (true, false) => inside.add(colour(frame, near)),
                (false, true) => outside.add(colour(frame, near)),
                _ => {}
            }
            if row.abs_diff(y) <= 1 && column.abs_diff(x) <= 1 {
                around += 1.0;
                of_object += f32::from(u8::from(object.bits()[near]));
            }
        }
    }
    let blurred = of_object / around;
    let share = match (inside.mean(), outside.mean()) {
        (Some(inside), Some(outside)) => {
            let (position, length) = on_line(colour(frame, at), outside, inside);
            (position + ALIKE * blurred) / (length + ALIKE)
        }
        _ => blurred,
    };
    (share.clamp(0.0, 1.0) * 255.0).round() as u8
}

fn colour(frame: &RgbImage, at: usize) -> [f32; 3] {
    let bytes = frame.as_raw();
    [bytes[3 * at], bytes[3 * at + 1], bytes[3 * at + 2]].map(f32::from)
}

/// The product of the pixel's way from `from` with the line to `to`, within it, and the line's length,
/// squared.
fn on_line(pixel: [f32; 3], from: [f32; 3], to: [f32; 3]) -> (f32, f32) {
    let (mut position, mut length) = (0.0, 0.0);
    for channel in 0..3 {
        let line = to[channel] - from[channel];
        position += (pixel[channel] - from[channel]) * line;
        length += line * line;
    }
    (position.clamp(0.0, length), length)
}

#[derive(Default)]
struct Average {
    sum: [f32; 3],
    count: f32,
}

impl Average {
    fn add(&mut self, colour: [f32; 3]) {
        self.sum.iter_mut().zip(colour).for_each(|(s, v)| *s += v);
        self.count += 1.0;
    }

    fn mean(&self) -> Option<[f32; 3]> {
        (self.count > 0.0).then(|| self.sum.map(|sum| sum / self.count))
    }
}

#[cfg(test)]
mod tests {
    use image::{Luma, Rgb};

    use super::*;

    /// The share of a disc of radius 14.3 around (30, 30) in a pixel, by 8 x 8 points.
    fn share(x: u32, y: u32) -> f64 {
        let point = |at: u32, part: u32| f64::from(at) + (f64::from(part) + 0.5) / 8.0 - 30.0;
        let inside = (0..64).filter(|i| point(x, i % 8).hypot(point(y, i / 8)) <= 14.3);
        inside.count() as f64 / 64.0
    }

    #[test]
    fn the_shares_along_a_discs_edge_come_back() {
        let frame = RgbImage::from_fn(60, 60, |x, y| {
            let mix = |object: f64, ground: f64| {
                (share(x, y) * object + (1.0 - share(x, y)) * ground).round() as u8
            };
            Rgb([mix(220.0, 30.0), mix(180.0, 40.0), mix(40.0, 60.0)])
        });
        let mask = GrayImage::from_fn(60, 60, |x, y| {
            Luma([if share(x, y) >= 0.5 { 255 } else { 0 }])
        });
        let soft = alpha(&frame, &mask);
        for (x, y, level) in soft.enumerate_pixels() {
            let off = (f64::from(level.0[0]) / 255.0 - share(x, y)).abs();
            assert!(off < 0.05, "({x}, {y}): {} {}", level.0[0], share(x, y));
        }
    }

    #[test]
    fn where_both_sides_look_alike_the_mask_is_blurred() {
        let frame = RgbImage::from_pixel(20, 20, Rgb([90, 90, 90]));
        let mask = GrayImage::from_fn(20, 20, |x, _| Luma([if x >= 10 { 255 } else { 0 }]));
        let soft = alpha(&frame, &mask);
        let row: Vec<u8> = (7..13).map(|x| soft.get_pixel(x, 9).0[0]).collect();
        assert_eq!(row, [0, 0, 85, 170, 255, 255]);
    }

    #[test]
    fn a_mask_of_another_size_is_returned_as_it_is() {
        let mask = GrayImage::new(4, 4);
        assert_eq!(alpha(&RgbImage::new(9, 9), &mask), mask);
    }
}
