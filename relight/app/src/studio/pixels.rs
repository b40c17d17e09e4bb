//! Pictures for a page: red, green, blue and alpha in 8 bits.

use std::sync::OnceLock;

use image::{GrayImage, RgbImage};
use relight_core::image::{
    ColourImage, ColourSpace, Extent, ImageError, Linear, Planes, Rgb, Samples, Srgb, StoredImage,
};

const OPAQUE: u8 = 255;

/// Planes of 0 to 1 as a page shows them.
pub(super) fn rgba(planes: &Planes<3>) -> Vec<u8> {
    painted(planes, byte)
}

/// Light as a page shows it.
pub(super) fn shown(light: &Rgb<Linear>) -> Vec<u8> {
    let table = SrgbTable::get();
    painted(light.planes(), |value| table.byte(value))
}

fn painted(planes: &Planes<3>, byte: impl Fn(f32) -> u8) -> Vec<u8> {
    let [red, green, blue] = planes.planes();
    let mut bytes = vec![OPAQUE; 4 * red.len()];
    let values = red.iter().zip(green).zip(blue);
    for (pixel, ((&r, &g), &b)) in bytes.chunks_exact_mut(4).zip(values) {
        (pixel[0], pixel[1], pixel[2]) = (byte(r), byte(g), byte(b));
    }
    bytes
}

/// Light times alpha, encoded as sRGB, with alpha: what a page adds to the light behind. Divided by alpha, bright edges would be
/// cut.
pub(super) fn covering(premultiplied: &Planes<3>, alpha: &Planes<1>) -> Vec<u8> {
    let table = SrgbTable::get();
    let [red, green, blue] = premultiplied.planes();
    let mut bytes = vec![0; 4 * red.len()];
    for (at, (pixel, &alpha)) in bytes.chunks_exact_mut(4).zip(alpha.plane(0)).enumerate() {
        if alpha > 0.0 {
            let colour = [red, green, blue].map(|plane| table.byte(plane[at]));
            pixel[..3].copy_from_slice(&colour);
            pixel[3] = byte(alpha);
        }
    }
    bytes
}

/// sRGB in 8 bits of linear light, by the leading bits of its floating point number: 512 steps from one power of two to the
/// next, so that a value is off by one at most, and only where it lies between two.
struct SrgbTable {
    bytes: Vec<u8>,
}

impl SrgbTable {
    /// Below, sRGB in 8 bits is 0.
    const MIN_VALUE: f32 = 1.0 / 8192.0;
    /// The bits of a number that the table does not look at.
    const REST: u32 = 23 - 9;

    fn get() -> &'static Self {
        static TABLE: OnceLock<SrgbTable> = OnceLock::new();
        TABLE.get_or_init(|| {
            let first = Self::MIN_VALUE.to_bits() >> Self::REST;
            let last = 1.0_f32.to_bits() >> Self::REST;
            let middle = 1 << (Self::REST - 1);
            let of = |step: u32| {
                byte(Srgb::from_linear(f32::from_bits(
                    (step << Self::REST) + middle,
                )))
            };
            Self {
                bytes: (first..last).map(of).collect(),
            }
        })
    }

    fn byte(&self, value: f32) -> u8 {
        if value >= 1.0 {
            return OPAQUE;
        }
        // What is no number is black.
        if value >= Self::MIN_VALUE {
            let step = (value.to_bits() >> Self::REST) - (Self::MIN_VALUE.to_bits() >> Self::REST);
            return self.bytes[step as usize];
        }
        0
    }
}

/// The nearest of 256 steps: by half a step more and what is whole of it, as to round is a call where a processor cannot.
fn byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0 + 0.5) as u8
}

/// Red, green and blue of pixels with alpha, and whether any alpha is not full.
pub(super) fn without_alpha(rgba: &[u8]) -> (Vec<u8>, bool) {
    let pixels = || rgba.chunks_exact(4);
    let colours = pixels().flat_map(|p| [p[0], p[1], p[2]]).collect();
    (colours, pixels().any(|p| p[3] != OPAQUE))
}

/// A picture in 8 bits, as a screen shows it.
pub(super) fn on_screen(image: &ColourImage) -> RgbImage {
    let planes = image.to_srgb().into_planes();
    let extent = planes.extent();
    RgbImage::from_raw(extent.width as u32, extent.height as u32, planes.to_bytes())
        .unwrap_or_default()
}

/// A picture in 8 bits with full alpha.
pub(super) fn opaque(image: &RgbImage) -> Vec<u8> {
    let pixels = image.as_raw().chunks_exact(3);
    pixels.flat_map(|p| [p[0], p[1], p[2], OPAQUE]).collect()
}

/// A mask of 0 to 1 in 8 bits.
pub(super) fn levels(mask: &Planes<1>) -> Vec<u8> {
    mask.plane(0).iter().map(|&value| byte(value)).collect()
}

/// A mask in 8 bits as a stored picture.
///
/// # Errors
/// None: its planes have its size.
pub(super) fn stored(mask: &GrayImage) -> Result<StoredImage, ImageError> {
    let plane: Vec<f32> = mask
        .as_raw()
        .iter()
        .map(|&v| f32::from(v) / 255.0)
        .collect();
    let extent = Extent::new(mask.width() as usize, mask.height() as usize);
    Ok(StoredImage {
        planes: Planes::from_planes(extent, [plane.clone(), plane.clone(), plane])?,
        alpha: None,
        samples: Samples::Integer,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_of_srgb_is_off_by_one_at_most_and_seldom() {
        let table = SrgbTable::get();
        let values = (0..=100_000).map(|at| (at as f32 / 100_000.0).powi(3));
        let off: Vec<i32> = values
            .map(|value| {
                let exact = i32::from(byte(Srgb::from_linear(value)));
                (i32::from(table.byte(value)) - exact).abs()
            })
            .collect();
        assert!(off.iter().all(|&off| off <= 1));
        assert!(
            off.iter().sum::<i32>() < 8_000,
            "{}",
            off.iter().sum::<i32>()
        );
        for (odd, wanted) in [(-1.0, 0), (f32::NAN, 0), (f32::INFINITY, 255), (7.0, 255)] {
            assert_eq!(table.byte(odd), wanted, "{odd}");
        }
    }

    #[test]
    fn what_covers_is_light_times_alpha() {
        let extent = Extent::new(2, 1);
        let light = Planes::filled(extent, [0.25, 0.0, 0.125]);
        let alpha = Planes::from_planes(extent, [vec![0.25, 0.0]]).unwrap();
        let bytes = covering(&light, &alpha);
        let [red, blue] = [0.25, 0.125].map(|value| SrgbTable::get().byte(value));
        assert_eq!(bytes, [red, 0, blue, 64, 0, 0, 0, 0]);
    }
}
