//! What the model leaves over: highlights and cast shadows.

use crate::fit::residuals::{reference, rest};
use rayon::prelude::*;
use relight_core::image::Planes;
use serde::Serialize;

use crate::fit::residuals::lit;
use crate::fit::solution::TurnSolution;
use crate::observe::curves::TurnCurves;

/// What exceeds the model and what falls short of it.
#[derive(Debug, Clone)]
pub struct TurnMaps {
    /// The most that a pixel exceeds its matt part by anywhere in the turn, in units of light, the mean of the
    /// channels; where it is clipped, as if it were just so bright. 0 outside the mask.
    pub highlight: Planes<1>,
    /// The part of the model's light over the whole turn that a pixel does not have, 0 to 1.
    pub shadow: Planes<1>,
    /// Both over the table's angle.
    pub over_angle: Vec<AngleFigure>,
}

/// What is left over at an angle, as a part of the model's mean light, the mean over the pixels.
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
    /// What a solution leaves over.
    #[must_use]
    pub fn new(curves: &TurnCurves, solution: &TurnSolution) -> Self {
        let room = &solution.room;
        let rests: Vec<Vec<Option<f64>>> = (0..curves.pixels())
            .into_par_iter()
            .map(|pixel| rest(curves, pixel, &solution.fits[pixel], room))
            .collect();
        let most = |pixel: usize| {
            let fit = &solution.fits[pixel];
            let unit = reference(curves, pixel, fit, room);
            let parts = rests[pixel].iter().zip(curves.waves());
            let excess = parts.map(|(rest, basis)| {
                let [matt, gloss] = lit(room, fit.normal, basis);
                match rest {
                    Some(rest) => rest * unit + gloss.iter().sum::<f64>() / 3.0,
                    None => {
                        let matt: f64 = (0..3).map(|c| fit.albedo[c] * matt[c]).sum();
                        curves.clipped_value() - matt / 3.0
                    }
                }
            });
            [excess.fold(0.0_f64, f64::max) as f32]
        };
        let missing = |pixel: usize| {
            let rests = &rests[pixel];
            let sum: f64 = rests.iter().flatten().map(|rest| (-rest).max(0.0)).sum();
            [(sum / rests.len().max(1) as f64).min(1.0) as f32]
        };
        Self {
            highlight: curves.map(most),
            shadow: curves.map(missing),
            over_angle: over_angle(curves, &rests),
        }
    }
}

pub(crate) fn over_angle(curves: &TurnCurves, rests: &[Vec<Option<f64>>]) -> Vec<AngleFigure> {
    let at = |(part, angle): (usize, &f64)| {
        let seen = rests.iter().filter_map(|rests| rests[part]);
        let (mut above, mut below, mut count) = (0.0, 0.0, 0.0);
        for rest in seen {
            above += rest.max(0.0);
            below += (-rest).max(0.0);
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
