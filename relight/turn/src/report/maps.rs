//! The residuals of the model: highlights and cast shadows.

use rayon::prelude::*;
use relight_core::image::Planes;
use serde::Serialize;

use crate::fit::residuals::residuals;
use crate::fit::solution::TurnSolution;
use crate::observe::curves::TurnCurves;

/// What exceeds the model and what falls short of it.
#[derive(Debug, Clone)]
pub struct TurnMaps {
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
