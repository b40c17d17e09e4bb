//! The residuals of the model: highlights and cast shadows.

use rayon::prelude::*;
use relight_core::image::Planes;
use serde::Serialize;

use crate::fit::residuals::{lit, reference, residuals};
use crate::fit::solution::TurnSolution;
use crate::observe::curves::TurnCurves;

/// What exceeds the model and what falls short of it.
#[derive(Debug, Clone)]
pub struct TurnMaps {
    /// The most that a pixel exceeds its diffuse part by anywhere in the turn, in units of light, the mean of the
    /// channels; where it is clipped, as if it were just so bright. 0 outside the mask.
    pub highlight: Planes<1>,
    /// The part of the model's light over the whole turn that a pixel does not have, 0 to 1.
    pub shadow: Planes<1>,
    /// Both over the table's angle.
    pub over_angle: Vec<AngleFigure>,
}

/// The residual at an angle, as a part of the model's mean light, the mean over the pixels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct AngleFigure {
    /// The table's angle, degrees.
    pub angle_deg: f64,
    /// How far pixels exceed the model.
    pub highlight: f64,
    /// How far they fall short of it.
    pub shadow: f64,
}

impl TurnMaps {
    /// The residuals of a solution.
    #[must_use]
    pub fn new(curves: &TurnCurves, solution: &TurnSolution) -> Self {
        let model = &solution.model;
        let residuals: Vec<Vec<Option<f64>>> = (0..curves.pixels())
            .into_par_iter()
            .map(|pixel| residuals(curves, pixel, &solution.fits[pixel], model))
            .collect();
        let most = |pixel: usize| {
            let fit = &solution.fits[pixel];
            let unit = reference(curves, pixel, fit, model);
            let parts = residuals[pixel].iter().zip(curves.harmonics());
            let excess = parts.map(|(residuals, basis)| {
                let [diffuse, gloss] = lit(model, fit.normal, basis);
                match residuals {
                    Some(residuals) => residuals * unit + gloss.iter().sum::<f64>() / 3.0,
                    None => {
                        let diffuse: f64 = (0..3).map(|c| fit.albedo[c] * diffuse[c]).sum();
                        curves.clipped_value() - diffuse / 3.0
                    }
                }
            });
            [excess.fold(0.0_f64, f64::max) as f32]
        };
        let missing = |pixel: usize| {
            let residuals = &residuals[pixel];
            let sum: f64 = residuals
                .iter()
                .flatten()
                .map(|residuals| (-residuals).max(0.0))
                .sum();
            [(sum / residuals.len().max(1) as f64).min(1.0) as f32]
        };
        Self {
            highlight: curves.map(most),
            shadow: curves.map(missing),
            over_angle: over_angle(curves, &residuals),
        }
    }
}

pub(crate) fn over_angle(curves: &TurnCurves, residuals: &[Vec<Option<f64>>]) -> Vec<AngleFigure> {
    let at = |(part, angle): (usize, &f64)| {
        let seen = residuals.iter().filter_map(|residuals| residuals[part]);
        let (mut above, mut below, mut count) = (0.0, 0.0, 0.0);
        for residuals in seen {
            above += residuals.max(0.0);
            below += (-residuals).max(0.0);
            count += 1.0;
        }
        let count = f64::max(count, 1.0);
        AngleFigure {
            angle_deg: angle.to_degrees(),
            highlight: above / count,
            shadow: below / count,
        }
    };
    curves.angles().iter().enumerate().map(at).collect()
}

#[cfg(test)]
mod tests;
