//! The image that the tests segment: a bright disc on a dark background, and hints for it.

use image::{GrayImage, Luma};

/// Width, pixels.
pub const WIDTH: u32 = 96;
/// Height, pixels.
pub const HEIGHT: u32 = 64;
/// A rectangle around the disc, as options have it.
pub const AROUND: &str = "24,8,50,48";

/// Whether a pixel is in the disc of radius 18 around (48, 32).
pub fn in_disc(x: u32, y: u32) -> bool {
    let (dx, dy) = (f64::from(x) - 48.0, f64::from(y) - 32.0);
    dx.hypot(dy) <= 18.0
}

/// Hints as an image: 255 object, 0 background, else nothing.
pub fn seeds_image(marks: impl Fn(u32, u32) -> u8) -> GrayImage {
    GrayImage::from_fn(WIDTH, HEIGHT, |x, y| Luma([marks(x, y)]))
}

/// A stroke across the disc, and one across the ground.
pub fn strokes(x: u32, y: u32) -> u8 {
    match (x, y) {
        (40..56, 30..33) => 255,
        (5..90, 3..6) => 0,
        _ => 128,
    }
}

/// Intersection over union of a mask and the disc.
pub fn disc_share(mask: &GrayImage) -> f64 {
    let (mut both, mut either) = (0, 0);
    for (x, y, pixel) in mask.enumerate_pixels() {
        let (found, true_one) = (pixel.0[0] >= 128, in_disc(x, y));
        both += u32::from(found && true_one);
        either += u32::from(found || true_one);
    }
    f64::from(both) / f64::from(either)
}
