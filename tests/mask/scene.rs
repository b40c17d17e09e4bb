//! The image that the tests segment: a bright disc on a dark background, and hints for it.

use image::{DynamicImage, GrayImage, Luma, Rgb, RgbImage};
use relit_mask::{Hints, Seeds};

pub(crate) const WIDTH: u32 = 96;
pub(crate) const HEIGHT: u32 = 64;
pub(crate) const AROUND: &str = "24,8,50,48";

/// A bright disc of radius 18 around (48, 32) on a dark ground, both with some texture.
pub(crate) fn disc() -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let noise = ((x * 7 + y * 13) % 11) as u8;
        if in_disc(x, y) {
            Rgb([200 + noise, 150 + noise, 60])
        } else {
            Rgb([20 + noise, 30, 40 + noise])
        }
    })
}

pub(crate) fn in_disc(x: u32, y: u32) -> bool {
    let (dx, dy) = (f64::from(x) - 48.0, f64::from(y) - 32.0);
    dx.hypot(dy) <= 18.0
}

pub(crate) fn around() -> Hints {
    Hints::Rect(AROUND.parse().unwrap())
}

pub(crate) fn seeds_image(marks: impl Fn(u32, u32) -> u8) -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| Luma([marks(x, y)]))
}

pub(crate) fn seeds(marks: impl Fn(u32, u32) -> u8) -> Seeds {
    Seeds::from_image(&DynamicImage::from(seeds_image(marks))).unwrap()
}

/// A stroke across the disc, and one across the ground.
pub(crate) fn strokes(x: u32, y: u32) -> u8 {
    match (x, y) {
        (40..56, 30..33) => 255,
        (5..90, 3..6) => 0,
        _ => 128,
    }
}

pub(crate) fn disc_share(mask: &GrayImage) -> f64 {
    let (mut both, mut either) = (0, 0);
    for (x, y, pixel) in mask.enumerate_pixels() {
        let (found, true_one) = (pixel.0[0] >= 128, in_disc(x, y));
        both += u32::from(found && true_one);
        either += u32::from(found || true_one);
    }
    f64::from(both) / f64::from(either)
}
