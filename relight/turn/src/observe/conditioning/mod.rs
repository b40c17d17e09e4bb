//! Whether normals and albedo are observable in the environment light.

use rayon::prelude::*;
use relight_core::light::NormalEquations;
use relit_data::statistics::median;
use serde::Serialize;

use crate::model::harmonics::LAMBERTIAN_COEFFICIENTS;
use crate::model::material::MaterialKind;
use crate::observe::curves::TurnCurves;
use crate::observe::verdict::TurnVerdict;

/// Least share of the pixels whose curves can be used, 0 to 1; with fewer the exposure was wrong. By hand.
const MIN_OBSERVABLE: f64 = 0.1;
/// Least mean light of a pixel that can be used, linear, of the three channels together. By hand: what is less is
/// black.
const MIN_LIGHT: f64 = 1e-5;
/// Least coverage of a turn, degrees. By hand: the network has seen gaps of up to 18 degrees, and up to
/// three of them.
const MIN_COVERAGE_DEG: f64 = 330.0;
/// Largest median of the errors that are expected, degrees. Measured: of 15 synthetic turns those below are off
/// by 7 to 14 degrees, and those above by 14 to 22 (docs/results/turns.md).
const MAX_EXPECTED_DEG: f64 = 15.0;

/// What to do about a turn that is nearly all clipped over half of it or more.
const OVEREXPOSED: &str = "the object is overexposed: nearly all of it is clipped for half the turn or more; lower exposure or \
                           gain, and capture again";
/// What to do about a turn that is nearly all black.
const UNDEREXPOSED: &str = "the object is underexposed: nearly all of it is black; lengthen the exposure or add light, and \
                            capture the turn again";

/// How well the light of the turn determines normals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Conditioning {
    /// The median over the pixels of the effective value of the first and second harmonic, over the mean.
    pub(crate) modulation: f64,
    /// The median over the pixels of the part of a curve's variation that lies beyond the second harmonic.
    pub(crate) beyond: f64,
    /// How many degrees of the turn the frames cover.
    pub(crate) coverage_deg: f64,
    /// What follows.
    pub(crate) verdict: TurnVerdict,
    /// What to do about an exposure that makes the turn useless.
    #[serde(skip)]
    pub(crate) exposure_advice: Option<&'static str>,
}

impl Conditioning {
    /// That of a turn.
    pub(crate) fn from_curves(curves: &TurnCurves) -> Self {
        let pixels: Vec<PixelLight> = (0..curves.pixels())
            .into_par_iter()
            .map(|pixel| of_pixel(curves, pixel))
            .collect();
        let figures = pixels.iter().filter_map(|observable| match observable {
            PixelLight::Curve { modulation, beyond } => Some((*modulation, *beyond)),
            PixelLight::Clipped | PixelLight::Black => None,
        });
        let modulation = median(figures.clone().map(|(modulation, _)| modulation)).unwrap_or(0.0);
        let beyond = median(figures.clone().map(|(_, beyond)| beyond)).unwrap_or(0.0);
        let observable = figures.count();
        let clipped = pixels
            .iter()
            .filter(|observable| matches!(observable, PixelLight::Clipped));
        let is_useless = (observable as f64) < MIN_OBSERVABLE * pixels.len() as f64;
        let is_white = 2 * clipped.count() >= pixels.len() - observable;
        let advice = if is_white { OVEREXPOSED } else { UNDEREXPOSED };
        Self {
            modulation,
            beyond,
            coverage_deg: curves.coverage_deg(),
            verdict: TurnVerdict::Good,
            exposure_advice: is_useless.then_some(advice),
        }
    }

    /// The same where such an error of the normals is expected, degrees, the median. What is expected of metal says little: it is
    /// seldom seen in training.
    pub(crate) fn expecting(self, expected_error_deg: f64, material: MaterialKind) -> Self {
        let verdict = if self.coverage_deg < MIN_COVERAGE_DEG {
            TurnVerdict::PartOfTurn
        } else if expected_error_deg > MAX_EXPECTED_DEG || material == MaterialKind::Metal {
            TurnVerdict::Uncertain
        } else {
            TurnVerdict::Good
        };
        Self { verdict, ..self }
    }
}

/// The observable part of the light at a pixel, all channels together.
enum PixelLight {
    /// Modulation, and the part beyond the second harmonic.
    Curve { modulation: f64, beyond: f64 },
    /// Nothing: a channel is clipped over most of the turn.
    Clipped,
    /// Nothing: it is black.
    Black,
}

fn of_pixel(curves: &TurnCurves, pixel: usize) -> PixelLight {
    let mut equations = NormalEquations::new(LAMBERTIAN_COEFFICIENTS);
    let mut seen = Vec::new();
    let parts = curves.values(pixel).iter().zip(curves.weights(pixel));
    for ((value, weight), harmonics) in parts.zip(curves.harmonics()) {
        if weight.iter().all(|&weight| weight > 0.5) {
            let grey = value.iter().map(|&v| f64::from(v)).sum::<f64>();
            equations.add(&harmonics[..LAMBERTIAN_COEFFICIENTS], [grey, 0.0, 0.0]);
            seen.push((grey, harmonics));
        }
    }
    if 2 * seen.len() < curves.parts() {
        return PixelLight::Clipped;
    }
    let Some(solution) = equations.solve() else {
        return PixelLight::Clipped;
    };
    let solution: Vec<f64> = solution.into_iter().map(|[value, ..]| value).collect();
    let mean = seen.iter().map(|(grey, _)| grey).sum::<f64>() / seen.len() as f64;
    let (mut all, mut rest) = (0.0, 0.0);
    for (grey, harmonics) in seen {
        let model: f64 = harmonics.iter().zip(&solution).map(|(a, b)| a * b).sum();
        all += (grey - mean).powi(2);
        rest += (grey - model).powi(2);
    }
    let harmonics: f64 = solution[1..].iter().map(|value| value * value).sum();
    let constant = solution[0];
    if constant <= MIN_LIGHT {
        return PixelLight::Black;
    }
    PixelLight::Curve {
        modulation: (harmonics / 2.0).sqrt() / constant,
        beyond: if all > 0.0 { rest / all } else { 0.0 },
    }
}

#[cfg(test)]
mod tests;
