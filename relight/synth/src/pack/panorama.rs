//! A panorama of a library: made small, compared with others, and as Radiance's bytes.

use std::ops::Range;

use image::Rgb;
use image::codecs::hdr::HdrEncoder;
use relight_core::image::Extent;
use relight_core::light::Panorama;

use super::candidates::Candidate;
use super::prepare::{EXCLUDED, Reason};

/// Largest size of panoramas: larger ones are made smaller.
const MAX_PANORAMA: Extent = Extent::new(512, 256);
/// The size at which two panoramas are compared, and how far they may be apart, in parts of their own variance.
const THUMBNAIL: Extent = Extent::new(32, 16);
const ALIKE: f32 = 0.02;
/// The exponents of the file end there.
const MIN_RADIANCE: f32 = 1e-30;
const MAX_RADIANCE: f32 = 1e38;

/// The panorama of a file, made small.
///
/// # Errors
/// Why it is left out.
pub(super) fn read(candidate: &Candidate) -> Result<Panorama, Reason> {
    if let Some(why) = &candidate.leave_out {
        return Err(Reason::new(EXCLUDED, why));
    }
    let panorama =
        Panorama::read(&candidate.path).map_err(|fault| Reason::unreadable(fault.to_string()))?;
    let rows = panorama.extent().height;
    let planes = panorama.image().planes();
    let is_black = |rows: Range<usize>| {
        let width = panorama.extent().width;
        let pixels = rows.flat_map(|y| (0..width).map(move |x| (x, y)));
        pixels
            .into_iter()
            .all(|(x, y)| planes.pixel(x, y).into_iter().all(|value| value <= 0.0))
    };
    // What was not photographed is black.
    if is_black(0..rows.div_ceil(8)) || is_black(rows - rows.div_ceil(8)..rows) {
        let why = "its upper or lower end is black: it does not show everything around";
        return Err(Reason::unreadable(why));
    }
    let is_large = panorama.extent().width > MAX_PANORAMA.width;
    Ok(if is_large {
        panorama.resized(MAX_PANORAMA)
    } else {
        panorama
    })
}

/// A panorama in few pixels, in the logarithm, without its mean.
pub(super) fn thumbnail(panorama: &Panorama) -> Vec<f32> {
    let small = panorama.resized(THUMBNAIL);
    let levels = small.image().planes().planes().into_iter().flatten();
    let mut levels: Vec<f32> = levels.map(|level| level.max(1e-6).ln()).collect();
    let mean = levels.iter().sum::<f32>() / levels.len() as f32;
    levels.iter_mut().for_each(|level| *level -= mean);
    levels
}

pub(super) fn are_alike(one: &[f32], other: &[f32]) -> bool {
    let square =
        |values: &mut dyn Iterator<Item = f32>| values.map(|value| value * value).sum::<f32>();
    let apart = square(&mut one.iter().zip(other).map(|(a, b)| a - b));
    apart < ALIKE * square(&mut one.iter().copied())
}

/// A panorama as Radiance's file.
///
/// # Errors
/// If it cannot be encoded.
pub(super) fn encode(panorama: &Panorama) -> Result<Vec<u8>, Reason> {
    let Extent { width, height } = panorama.extent();
    let planes = panorama.image().planes();
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let pixels: Vec<Rgb<f32>> = places
        .map(|(x, y)| Rgb(rounded(planes.pixel(x, y))))
        .collect();
    let mut bytes = Vec::new();
    let encoded = HdrEncoder::new(&mut bytes).encode(&pixels, width, height);
    encoded.map_err(|fault| Reason::unreadable(fault.to_string()))?;
    Ok(bytes)
}

/// The nearest radiance that the file can hold, which the encoder would cut off: 8 bits of the largest channel. Radiance
/// below 0 is 0.
fn rounded(pixel: [f32; 3]) -> [f32; 3] {
    let largest = pixel.into_iter().fold(0.0, f32::max).min(MAX_RADIANCE);
    if largest < MIN_RADIANCE {
        return [0.0; 3];
    }
    let step = (largest.log2().floor() - 7.0).exp2();
    pixel.map(|value| (value / step).round().clamp(0.0, 255.0) * step)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use relight_core::image::Planes;

    use super::*;

    #[test]
    fn bright_and_dark_radiance_keeps_its_ratio() {
        let planes = Planes::from_fn(Extent::new(16, 8), |x, y| {
            let level = 10.0_f32.powi(x as i32 - 6);
            [level, 0.5 * level, y as f32 * 0.1 * level]
        });
        let panorama = Panorama::new(relight_core::image::Rgb::new(planes)).unwrap();
        let bytes = encode(&panorama).unwrap();
        let again = Panorama::from_bytes(Path::new("a.hdr"), &bytes).unwrap();
        for (x, y) in (0..8).flat_map(|y| (0..16).map(move |x| (x, y))) {
            let [own, read] = [&panorama, &again].map(|p| p.image().planes().pixel(x, y));
            let apart = [0, 1, 2].map(|k| (own[k] - read[k]).abs());
            let half = own[0] / 255.0;
            assert!(
                apart.into_iter().all(|apart| apart <= half),
                "{own:?} {read:?}"
            );
        }
        assert_eq!(rounded([0.0, -1.0, 0.0]), [0.0; 3]);
        assert!(rounded([f32::MAX, 0.0, 0.0])[0] > 0.9e38);
    }
}
