//! The albedo of pixels with uncertain normals, from their neighbours with certain ones. Knows nothing of light.
//!
//! A wrong normal has a wrong shading, and so its pixel a wrong albedo. Albedos of one surface are alike where its
//! colour is, and the chromaticity of a pixel's mean light shows that without any normal.

use rayon::prelude::*;

use crate::fit::curve_statistics::CurveStatistics;
use crate::observe::curves::TurnCurves;

/// Expected error of a normal at which its pixel's own albedo counts one half, radians. By hand.
const HALF_ERROR: f64 = 0.14;
/// Standard deviation of the surroundings, in widths of the frame. By hand.
const REACH: f64 = 1.0 / 32.0;
/// Pixels that are looked at, from the middle to two standard deviations. By hand.
const TAPS: isize = 8;
/// Standard deviation of chromaticities of one surface. By hand.
const SAME_COLOUR: f64 = 0.05;

/// The albedo of each pixel, shrunk toward those of the same colour around it as far as its normal is expected to be
/// off, radians.
pub(crate) fn shared(curves: &TurnCurves, albedo: &[[f64; 3]], errors: &[f64]) -> Vec<[f64; 3]> {
    let extent = curves.extent();
    let mut at = vec![None; extent.pixels()];
    for (pixel, &place) in curves.places().iter().enumerate() {
        at[place] = Some(pixel);
    }
    let colours: Vec<[f64; 3]> = (0..curves.pixels())
        .map(|pixel| chromaticity(CurveStatistics::mean(curves, pixel)))
        .collect();
    let confidence: Vec<f64> = errors
        .iter()
        .map(|error| 1.0 / (1.0 + (error / HALF_ERROR).powi(2)))
        .collect();
    let deviation = REACH * extent.width as f64;
    let step = (2.0 * deviation / TAPS as f64).max(1.0);
    let around: Vec<(isize, isize, f64)> = (-TAPS..=TAPS)
        .flat_map(|down| (-TAPS..=TAPS).map(move |right| (down, right)))
        .map(|(down, right)| {
            let [down, right] = [down, right].map(|taps| (taps as f64 * step).round());
            let square = (down * down + right * right) / (deviation * deviation);
            (down as isize, right as isize, (-0.5 * square).exp())
        })
        .collect();
    let pixel_at = |place: usize, down: isize, right: isize| {
        let row = (place / extent.width).checked_add_signed(down)?;
        let column = (place % extent.width).checked_add_signed(right)?;
        let is_in = row < extent.height && column < extent.width;
        is_in.then(|| at[row * extent.width + column])?
    };
    (0..curves.pixels())
        .into_par_iter()
        .map(|pixel| {
            let (mut sum, mut weights) = ([0.0; 3], 0.0);
            for &(down, right, near) in &around {
                let Some(other) = pixel_at(curves.places()[pixel], down, right) else {
                    continue;
                };
                let apart: f64 = (0..3)
                    .map(|c| (colours[pixel][c] - colours[other][c]).powi(2))
                    .sum();
                let alike = (-0.5 * apart / (SAME_COLOUR * SAME_COLOUR)).exp();
                let weight = near * alike * confidence[other] * confidence[other];
                for (sum, albedo) in sum.iter_mut().zip(albedo[other]) {
                    *sum += weight * albedo;
                }
                weights += weight;
            }
            let own = confidence[pixel];
            std::array::from_fn(|c| own * albedo[pixel][c] + (1.0 - own) * sum[c] / weights)
        })
        .collect()
}

/// The parts of the channels in their sum.
fn chromaticity(light: [f64; 3]) -> [f64; 3] {
    let sum = light.iter().sum::<f64>().max(1e-6);
    light.map(|value| value / sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::observe::curves::CurveBuilder;
    use relight_core::image::{Extent, Planes};

    const EXTENT: Extent = Extent {
        width: 64,
        height: 16,
    };

    /// A red half and a grey one, in even light.
    fn halves() -> TurnCurves {
        let picture = Planes::from_fn(EXTENT, |x, _| {
            if x < 32 {
                [0.4, 0.1, 0.1]
            } else {
                [0.2, 0.2, 0.2]
            }
        });
        let mut builder = CurveBuilder::new(EXTENT, &vec![1.0; EXTENT.pixels()]).unwrap();
        for k in 0..12 {
            let angle = 30.0 * f64::from(k);
            builder.push(angle, EXTENT, picture.planes()).unwrap();
        }
        builder.finish().unwrap()
    }

    #[test]
    fn a_wrong_albedo_becomes_that_of_the_same_colour_around_it_and_right_ones_stay() {
        let curves = halves();
        let truth = |pixel: usize| {
            if pixel % 64 < 32 {
                [0.8, 0.2, 0.2]
            } else {
                [0.4, 0.4, 0.4]
            }
        };
        let mut albedo: Vec<[f64; 3]> = (0..curves.pixels()).map(truth).collect();
        let mut errors = vec![0.0; albedo.len()];
        // On both sides of the border.
        let wrong = [8 * 64 + 31, 8 * 64 + 32];
        for pixel in wrong {
            albedo[pixel] = albedo[pixel].map(|value| 0.3 * value);
            errors[pixel] = 1.5;
        }
        let found = shared(&curves, &albedo, &errors);
        for (pixel, found) in found.iter().enumerate() {
            let off = |c: usize| (found[c] / truth(pixel)[c] - 1.0).abs();
            let most = if wrong.contains(&pixel) { 0.05 } else { 1e-9 };
            assert!((0..3).all(|c| off(c) < most), "{pixel}: {found:?}");
        }
    }
}
