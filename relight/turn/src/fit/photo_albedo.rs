//! The albedo that the network of photographs sees in frames of a turn, and its mean with another one.

use relight_core::image::{Linear, Planes, Rgb};
use relight_photo::decompose::{DecomposeOptions, Decomposer, SpecularGate};
use relight_photo::nets::Weights;
use relit_data::statistics::median;

use crate::error::TurnError;
use crate::observe::curves::TurnCurves;

/// Frames that are decomposed, spread over the turn. Measured: twelve do not reduce the error.
const FRAMES: usize = 4;
/// The least albedo that counts: darker ones are noise. Numerical.
const DARKEST: f32 = 1e-4;

/// The albedo of the decomposing network: the geometric mean over a few frames of the turn, each in
/// another light. Its unit is not known.
///
/// # Errors
/// If the network fails.
pub(crate) fn photo_albedo(
    weights: &Weights,
    frames: &[Rgb<Linear>],
    mask: &Planes<1>,
) -> Result<Rgb<Linear>, TurnError> {
    let decomposer = Decomposer::new(weights)?;
    let every = frames.len().div_ceil(FRAMES).max(1);
    let chosen = frames.iter().step_by(every);
    let part = 1.0 / chosen.len() as f32;
    let mut logarithms = Planes::<3>::zeros(mask.extent());
    for picture in chosen {
        let found = decomposer.decompose(picture, mask, &without_gate())?;
        let pairs = logarithms
            .planes_mut()
            .into_iter()
            .zip(found.albedo.planes().planes());
        for (sum, plane) in pairs {
            sum.iter_mut()
                .zip(plane)
                .for_each(|(sum, value)| *sum += part * value.max(DARKEST).ln());
        }
    }
    Ok(Rgb::new(logarithms.map(f32::exp)))
}

/// The geometric mean of two albedos of one object, each in units of its own: each channel has the median of the first under
/// the mask. Two networks that look at other things, a picture and its changes over the turn, err in other places.
pub(crate) fn mean_albedo(
    curves: &TurnCurves,
    one: &Rgb<Linear>,
    other: &Rgb<Linear>,
) -> Vec<[f64; 3]> {
    let logarithms = |albedo: &Rgb<Linear>| -> Vec<[f64; 3]> {
        let darkest = f64::from(DARKEST);
        let values = curves.pixels_of(albedo.planes());
        values
            .map(|albedo| albedo.map(|value| value.max(darkest).ln()))
            .collect()
    };
    let (one, other) = (logarithms(one), logarithms(other));
    let units = [0, 1, 2].map(|c| {
        let apart = one.iter().zip(&other).map(|(one, other)| one[c] - other[c]);
        median(apart).unwrap_or(0.0)
    });
    let pairs = one.into_iter().zip(other);
    let mean =
        pairs.map(|(one, other)| [0, 1, 2].map(|c| one[c].midpoint(other[c] + units[c]).exp()));
    mean.collect()
}

/// How frames of a turn are decomposed.
fn without_gate() -> DecomposeOptions {
    DecomposeOptions {
        specular: SpecularGate::Off,
        ..DecomposeOptions::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::{TAKE, ball, environment, film};

    fn are_alike(a: &[[f64; 3]], b: &[[f64; 3]]) -> bool {
        let pairs = a.iter().flatten().zip(b.iter().flatten());
        pairs.into_iter().all(|(a, b)| (a / b - 1.0).abs() < 1e-5)
    }

    #[test]
    fn the_mean_of_two_albedos_does_not_depend_on_the_unit_of_the_second() {
        let curves = film(&ball(), &environment(), TAKE);
        let one = ball().albedo().clone();
        let other = |unit: f32| {
            Rgb::new(Planes::from_fn(curves.extent(), |x, y| {
                [0.2 + 0.01 * x as f32, 0.2 + 0.03 * y as f32, 0.3].map(|value| unit * value)
            }))
        };
        let [found, again] = [1.0, 5.0].map(|unit| mean_albedo(&curves, &one, &other(unit)));
        assert!(are_alike(&found, &again));
        // What both say alike stays.
        let same: Vec<[f64; 3]> = curves.pixels_of(one.planes()).collect();
        assert!(are_alike(&mean_albedo(&curves, &one, &one), &same));
    }
}
