//! Normals and albedo of a whole turn in a light that is known: photometric stereo.

use rayon::prelude::*;
use relight_core::light::ShLight;
use relight_core::statistics::{median, quantile};

use crate::fit::confidence::{
    FREEDOM, FittedPixels, OwnError, common_error, own_errors, shared_albedo,
};
use crate::fit::curve_statistics::{CurveStatistics, all_statistics};
use crate::fit::joint::JointOptimisation;
use crate::fit::residuals::robust_weights;
use crate::fit::search::{PixelFit, search_all};
use crate::fit::solution::TurnSolution;
use crate::fit::unknowns::Unknowns;
use crate::model::frame::{Elevation, TableFrame};
use crate::model::known_light::KnownLight;
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;

/// Number of blocks, or of pixels, on which the gloss is fitted. By hand.
const PIXELS: usize = 2500;
/// Rounds of the joint optimisation on blocks: before each, the normals are searched anywhere. By hand.
const JOINT_ROUNDS: usize = 2;
/// Gauss-Newton steps in each of them. By hand.
const JOINT_STEPS: usize = 8;
/// Gauss-Newton steps of the joint optimisation in each robust round. By hand.
const ROBUST_STEPS: usize = 3;
/// Rounds of robust weights. By hand.
const ROBUST_ROUNDS: usize = 3;
/// Quantile of the distances that measures the spread of albedos. By hand: spots of another colour count, a few
/// pixels that went wrong do not.
const SPREAD_QUANTILE: f64 = 0.9;
/// Where that quantile is, in standard deviations. Derived: of the absolute value of a normal distribution.
const SPREAD_DEVIATIONS: f64 = 1.645;

/// Finds the normals and albedo that fit the curves of a turn best in a light that was given or measured, in the viewer's
/// frame at the table's angle 0; bands up to 6 count.
///
/// Gloss is fitted on blocks of pixels, then every pixel by itself. Then parts of the turn with a large residual, shadows
/// and highlights, count less for that pixel, and it is fitted again.
#[must_use]
pub fn solve_in_light(
    curves: &TurnCurves,
    light: &ShLight,
    elevation: Elevation,
    material: MaterialKind,
) -> TurnSolution {
    let frame = TableFrame::new(elevation);
    let unknowns = Unknowns {
        frame,
        known: &KnownLight::new(light, &frame),
        material,
    };
    let model = model_of_blocks(curves, unknowns);
    let conditioning = Conditioning::of(curves).in_given(&unknowns.initial());
    let statistics = all_statistics(curves);
    let mut solver = Solver {
        curves,
        unknowns,
        fits: search_all(&model, &statistics, None),
        model,
        statistics,
    };
    for _ in 0..ROBUST_ROUNDS {
        solver.refine();
    }
    solver.shrink_albedo();
    let common = common_error(elevation, conditioning.verdict.is_fit());
    let own_errors = solver.own_errors();
    TurnSolution {
        albedo: shared_albedo(curves, &solver.fits, &own_errors),
        expected_errors: own_errors.iter().map(|own| own.with(common)).collect(),
        fits: solver.fits,
        model: solver.model,
        elevation,
        measured: Some(light.clone()),
        conditioning,
    }
}

/// The shading model that fits blocks of pixels best.
fn model_of_blocks(curves: &TurnCurves, unknowns: Unknowns<'_>) -> ShadingModel {
    let pixels = curves.pixels() as f64 / PIXELS as f64;
    let side = (pixels.sqrt().ceil() as usize).max(1);
    let joint = JointOptimisation {
        statistics: &all_statistics(&curves.reduced(side)),
        unknowns,
    };
    joint.found(unknowns.initial(), JOINT_ROUNDS, JOINT_STEPS)
}

/// All pixels under one light.
struct Solver<'a> {
    curves: &'a TurnCurves,
    unknowns: Unknowns<'a>,
    model: ShadingModel,
    statistics: Vec<CurveStatistics>,
    fits: Vec<PixelFit>,
}

impl Solver<'_> {
    /// Weights parts of the turn by their residuals, fits the gloss again, and then every pixel.
    fn refine(&mut self) {
        let (curves, model) = (self.curves, &self.model);
        self.statistics = (0..curves.pixels())
            .into_par_iter()
            .map(|pixel| {
                let robust_weights = robust_weights(curves, pixel, &self.fits[pixel], model);
                CurveStatistics::new(curves, pixel, Some(&robust_weights))
            })
            .collect();
        let every = self.statistics.len().div_ceil(PIXELS).max(1);
        let statistics: Vec<CurveStatistics> =
            self.statistics.iter().step_by(every).copied().collect();
        let fits: Vec<PixelFit> = self.fits.iter().step_by(every).copied().collect();
        let near = search_all(&self.model, &statistics, Some(&fits));
        let joint = JointOptimisation {
            statistics: &statistics,
            unknowns: self.unknowns,
        };
        (self.model, _) = joint.refined(self.model, near, ROBUST_STEPS);
        self.fits = search_all(&self.model, &self.statistics, Some(&self.fits));
    }

    /// Shrinks the albedo of pixels that hardly see light, or whose residual is large, toward the median of all.
    fn shrink_albedo(&mut self) {
        let fits = &self.fits;
        let of_channel = |c: usize| fits.iter().map(move |fit| fit.albedo[c]);
        let middle = [0, 1, 2].map(|c| median(of_channel(c)).unwrap_or(0.0));
        // By the ninth tenth of the distances: spots of another colour count, a few pixels that went wrong do not.
        let spread = [0, 1, 2].map(|c| {
            let distances = of_channel(c).map(|one| (one - middle[c]).abs());
            quantile(distances, SPREAD_QUANTILE).unwrap_or(0.0) / SPREAD_DEVIATIONS
        });
        let model = &self.model;
        self.fits
            .par_iter_mut()
            .zip(&self.statistics)
            .filter(|(_, statistics)| !statistics.is_dark())
            .for_each(|(fit, statistics)| {
                let harmonics = model.harmonics(fit.normal);
                fit.albedo = statistics.shrunk_albedo(&harmonics, (middle, spread), FREEDOM);
            });
    }

    /// What each pixel's normal is expected to be off by itself.
    fn own_errors(&self) -> Vec<OwnError> {
        own_errors(FittedPixels {
            curves: self.curves,
            statistics: &self.statistics,
            model: &self.model,
            fits: &self.fits,
        })
    }
}

#[cfg(test)]
mod tests;
