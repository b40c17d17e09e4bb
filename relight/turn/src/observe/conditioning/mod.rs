//! Whether normals and albedo are observable in the environment light.

use rayon::prelude::*;
use relight_core::light::NormalEquations;
use relit_data::statistics::median;
use relit_data::turn_light::MIN_MODULATION;
use serde::Serialize;

use crate::model::directions::half_sphere;
use crate::model::harmonics::{COEFFICIENTS, LAMBERTIAN_COEFFICIENTS};
use crate::model::shading::ShadingModel;
use crate::observe::curves::TurnCurves;
use crate::observe::verdict::TurnVerdict;

/// Largest share of the variation beyond the second harmonic, 0 to 1. By hand: above it the modulation is not that
/// of a Lambertian surface.
const MAX_BEYOND: f64 = 0.3;
/// Least share of the pixels whose curves can be used, 0 to 1; with fewer the exposure was wrong. By hand.
const MIN_OBSERVABLE: f64 = 0.1;
/// Least mean light of a pixel that can be used, linear, of the three channels together. By hand: what is less is
/// black.
const MIN_LIGHT: f64 = 1e-5;
/// Normals on which the modulation of a given light is measured. By hand.
const NORMALS: usize = 100;
/// Least coverage of a turn in unknown light, degrees. By hand: the network has seen gaps of up to 18 degrees, and up to
/// three of them.
const MIN_COVERAGE_DEG: f64 = 330.0;
/// Largest median of the errors that are expected in unknown light, degrees. Measured: of 15 synthetic turns those below are off
/// by 7 to 14 degrees, and those above by 14 to 22 (docs/results/turns.md).
const MAX_EXPECTED_DEG: f64 = 15.0;

/// How well the light of the turn determines normals.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct Conditioning {
    /// The median over the pixels of the effective value of the first and second harmonic, over the mean.
    pub(crate) modulation: f64,
    /// The median over the pixels of the part of a curve's variation that lies beyond the second harmonic.
    pub(crate) beyond: f64,
    /// The effective value of the harmonics over the mean in a light that was given: the median over the normals that
    /// face the viewer.
    pub(crate) given_modulation: Option<f64>,
    /// How many degrees of the turn the frames cover.
    pub(crate) coverage_deg: f64,
    /// What follows.
    pub(crate) verdict: TurnVerdict,
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
        let verdict = if (observable as f64) < MIN_OBSERVABLE * pixels.len() as f64 {
            if 2 * clipped.count() >= pixels.len() - observable {
                TurnVerdict::Overexposed
            } else {
                TurnVerdict::Underexposed
            }
        } else if modulation < MIN_MODULATION {
            TurnVerdict::TooEven
        } else if beyond > MAX_BEYOND {
            TurnVerdict::NotLambertian
        } else {
            TurnVerdict::Good
        };
        Self {
            modulation,
            beyond,
            given_modulation: None,
            coverage_deg: curves.coverage_deg(),
            verdict,
        }
    }

    /// The same in a light that is not known, where the network of turns expects such an error of its normals, degrees, the
    /// median.
    pub(crate) fn by_network(self, expected_error_deg: f64) -> Self {
        let verdict = if self.coverage_deg < MIN_COVERAGE_DEG {
            TurnVerdict::PartOfTurn
        } else if expected_error_deg > MAX_EXPECTED_DEG {
            TurnVerdict::Uncertain
        } else {
            TurnVerdict::Good
        };
        Self { verdict, ..self }
    }

    /// Whether a light was given that is too even while the turn is not.
    pub(crate) fn contradicts_given_light(&self) -> bool {
        let given = self.given_modulation;
        given.is_some_and(|given| given < MIN_MODULATION) && self.modulation >= MIN_MODULATION
    }

    /// The same where the light was given, as an object shows it in this environment that blurs nothing: one that is
    /// too even determines no more than an even turn.
    pub(crate) fn in_given(self, model: &ShadingModel) -> Self {
        let modulations = half_sphere(NORMALS).map(|normal| {
            let harmonics = model.harmonics(normal).base;
            let sum = |coefficient: usize| {
                harmonics
                    .iter()
                    .map(|harmonics| harmonics[coefficient])
                    .sum::<f64>()
            };
            let harmonics: f64 = (1..COEFFICIENTS)
                .map(|coefficient| sum(coefficient).powi(2))
                .sum();
            let mean = sum(0);
            if mean > 0.0 {
                (harmonics / 2.0).sqrt() / mean
            } else {
                0.0
            }
        });
        let modulation = median(modulations).unwrap_or(0.0);
        let is_even = modulation < MIN_MODULATION && self.verdict.is_fit();
        Self {
            given_modulation: Some(modulation),
            verdict: if is_even {
                TurnVerdict::TooEven
            } else {
                self.verdict
            },
            ..self
        }
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
