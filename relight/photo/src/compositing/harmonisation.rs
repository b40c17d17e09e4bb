//! Properties of a background that an inserted object adopts: brightness, white balance, grain. Knows pictures only.

use relight_core::image::{ColourSpace, Extent, Linear, Planes, Rgb, Srgb};
use relit_data::statistics::above_part;

/// The light that bright places of a picture have that was exposed well.
const BRIGHT: f32 = 0.8;
/// The part of the values that is brighter than a picture's bright places.
const BRIGHTEST_PART: f64 = 0.05;
/// The limits of an object's change of brightness.
const LEVELS: (f32, f32) = (0.05, 1.5);
/// How far a channel of the light's colour may be from grey.
const CASTS: (f32, f32) = (0.7, 1.4);
/// The power of the mean by which the light's colour is estimated: between grey world (1) and the brightest value.
const SHADES_OF_GREY: i32 = 6;
/// The side of the squares in which grain is measured, pixels.
const SQUARE: usize = 16;
/// The part of the squares that is smoother than the one that counts: the others show more than grain.
const SMOOTHEST_PART: f64 = 0.1;
/// Grain is as fine as the pixels: in half the size it has half the deviation. A square that keeps more than this part of it there
/// shows gravel, cloth or leaves.
const FINE: f32 = 0.75;
/// Deviations below this come from rounding to 8 bits: they say nothing about the grain.
const ROUNDING: f32 = 2e-3;
/// The part of the squares that must show only grain for it to be measured.
const MIN_PART: f64 = 0.02;
/// The most grain that a camera makes.
const MAX_GRAIN: f32 = 0.06;

/// What a background asks of the objects that are put into it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Harmonisation {
    /// What the light is multiplied with, 1 for a picture that was exposed well.
    pub level: f32,
    /// The colour of the light, of mean 1.
    pub balance: [f32; 3],
    /// Standard deviation of the grain, in sRGB values of 0 to 1.
    pub grain: f32,
}

impl Default for Harmonisation {
    fn default() -> Self {
        Self {
            level: 1.0,
            balance: [1.0; 3],
            grain: 0.0,
        }
    }
}

impl Harmonisation {
    /// Looks at a background: how bright its bright places are, the colour of its light by shades of grey (Finlayson and Trezzi,
    /// 2004), and its grain where it is smoothest.
    pub fn from_background(background: &Rgb<Linear>) -> Self {
        Self {
            level: (bright(background) / BRIGHT).clamp(LEVELS.0, LEVELS.1),
            balance: balance(background),
            grain: grain(background.planes(), None),
        }
    }
}

/// The light that one value in twenty exceeds.
fn bright(picture: &Rgb<Linear>) -> f32 {
    let values = picture.planes().brightest().filter(|v| v.is_finite());
    above_part(values, 1.0 - BRIGHTEST_PART).unwrap_or(BRIGHT)
}

fn balance(picture: &Rgb<Linear>) -> [f32; 3] {
    let means = picture.planes().planes().map(|plane| {
        let powers = plane
            .iter()
            .map(|&v| f64::from(v.clamp(0.0, 1.0)).powi(SHADES_OF_GREY));
        (powers.sum::<f64>() / plane.len().max(1) as f64).powf(1.0 / f64::from(SHADES_OF_GREY))
    });
    let mean = means.iter().sum::<f64>() / 3.0;
    if mean <= 0.0 {
        return [1.0; 3];
    }
    means.map(|m| ((m / mean) as f32).clamp(CASTS.0, CASTS.1))
}

/// The standard deviation of the grain of a linear picture, in sRGB values, where `alpha` is 1: by Immerkær's mask (1996), which
/// answers to neither planes nor edges, in the smoothest of the squares that show nothing coarser.
pub(crate) fn grain(picture: &Planes<3>, alpha: Option<&Planes<1>>) -> f32 {
    let Extent { width, height } = picture.extent();
    let green: Vec<f32> = picture
        .plane(1)
        .iter()
        .map(|&v| Srgb::from_linear(v.clamp(0.0, 1.0)))
        .collect();
    let halved = halved(&green, picture.extent());
    let (mut squares, mut deviations) = (0_usize, Vec::new());
    for top in (0..height.saturating_sub(SQUARE + 1)).step_by(SQUARE) {
        for left in (0..width.saturating_sub(SQUARE + 1)).step_by(SQUARE) {
            let inside = |alpha: &Planes<1>| {
                (top..top + SQUARE + 2).all(|y| {
                    alpha.plane(0)[y * width + left..][..SQUARE + 2]
                        .iter()
                        .all(|&a| a >= 1.0)
                })
            };
            if alpha.is_none_or(inside) {
                squares += 1;
                let fine = deviation(&green, width, [left, top], SQUARE);
                let coarse = deviation(&halved, width / 2, [left / 2, top / 2], SQUARE / 2 - 1);
                if fine <= ROUNDING || coarse <= FINE * fine {
                    deviations.push(fine);
                }
            }
        }
    }
    if (deviations.len() as f64) < MIN_PART * squares as f64 {
        return 0.0;
    }
    above_part(deviations, SMOOTHEST_PART)
        .unwrap_or(0.0)
        .min(MAX_GRAIN)
}

/// The deviation in a square of so many pixels a side, whose first has this column and row; the pixels around it are read too.
fn deviation(values: &[f32], width: usize, [left, top]: [usize; 2], side: usize) -> f32 {
    let mut sum = 0.0;
    for y in top + 1..=top + side {
        for x in left + 1..=left + side {
            let line = |row: usize| &values[row * width + x - 1..][..3];
            let [above, here, below] = [line(y - 1), line(y), line(y + 1)];
            let outer = above[0] - 2.0 * above[1] + above[2] + below[0] - 2.0 * below[1] + below[2];
            sum += (outer - 2.0 * here[0] + 4.0 * here[1] - 2.0 * here[2]).abs();
        }
    }
    sum * std::f32::consts::FRAC_PI_2.sqrt() / (6.0 * (side * side) as f32)
}

/// The means of two by two pixels; an odd last column or row is left out.
fn halved(values: &[f32], extent: Extent) -> Vec<f32> {
    let Extent { width, height } = extent;
    let rows = (0..height / 2).flat_map(|y| (0..width / 2).map(move |x| 2 * (y * width + x)));
    rows.map(|at| (values[at] + values[at + 1] + values[at + width] + values[at + width + 1]) / 4.0)
        .collect()
}

/// Noise of mean 0 and deviation 1 for a pixel of a frame: nearly normal, always the same.
pub(crate) fn noise(frame: u64, pixel: usize) -> f32 {
    let mut hash = (pixel as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)
        ^ frame.wrapping_mul(0xd1b5_4a32_d192_ed03);
    for shift in [30, 27, 31] {
        hash = (hash ^ (hash >> shift)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    let parts = [0, 16, 32, 48].map(|shift| (hash >> shift & 0xffff) as f32 / 65_535.0);
    // Each of four even numbers has the variance 1 / 12.
    (parts.iter().sum::<f32>() - 2.0) * 3.0_f32.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noisy(deviation: f32) -> Planes<3> {
        Planes::from_fn(Extent::new(120, 100), |x, y| {
            let value = 0.3 + x as f32 / 400.0 + deviation * noise(1, y * 120 + x);
            [Srgb::to_linear(value); 3]
        })
    }

    #[test]
    fn grain_is_found_as_strong_as_it_is() {
        for deviation in [0.005, 0.02, 0.05] {
            let found = grain(&noisy(deviation), None);
            assert!((found / deviation - 1.0).abs() < 0.3, "{deviation} {found}");
        }
        assert!(grain(&noisy(0.0), None) < 1e-3);
        assert_eq!(
            grain(&noisy(0.1), Some(&Planes::zeros(Extent::new(120, 100)))),
            0.0
        );
    }

    #[test]
    fn gravel_is_no_grain_and_grain_before_it_is_found_on_the_sky() {
        // Stones of four pixels, each with a brightness of its own.
        let stone =
            |x: usize, y: usize| 0.4 + 0.12 * noise(2, (y / 4) * 97 + (x + 2 * (y / 4)) / 4);
        let gravel = |sky: usize| {
            Planes::from_fn(Extent::new(192, 160), |x, y| {
                let value = if y < sky { 0.6 } else { stone(x, y) };
                [Srgb::to_linear(value + 0.01 * noise(1, y * 192 + x)); 3]
            })
        };
        let found = grain(&gravel(0), None);
        assert!(found < 5e-3, "{found}");
        let found = grain(&gravel(60), None);
        assert!((found / 0.01 - 1.0).abs() < 0.4, "{found}");
    }

    #[test]
    fn a_dark_yellow_picture_asks_for_less_and_yellow_light() {
        let picture = Rgb::new(Planes::from_fn(Extent::new(40, 40), |x, _| {
            [0.2, 0.18, 0.1].map(|v| v * x as f32 / 40.0)
        }));
        let found = Harmonisation::from_background(&picture);
        assert!((found.level - 0.19 / 0.8).abs() < 0.02, "{found:?}");
        assert!(
            found.balance[0] > 1.1 && found.balance[2] < 0.8,
            "{found:?}"
        );
        let even = Harmonisation::from_background(&Rgb::new(Planes::filled(
            Extent::new(40, 40),
            [0.8; 3],
        )));
        assert_eq!(even, Harmonisation::default());
    }
}
