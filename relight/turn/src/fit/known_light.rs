//! Normals and albedo of a whole turn in a light that is known: photometric stereo.

use rayon::prelude::*;
use relight_core::light::ShLight;
use relight_core::statistics::{median, quantile};

use crate::fit::confidence::{
    ERROR_PARAMETERS, FittedPixels, OwnError, common_error, own_errors, shared_albedo,
};
use crate::fit::curve_statistics::{CurveStatistics, all_statistics};
use crate::fit::joint::JointOptimisation;
use crate::fit::robust::robust_weights;
use crate::fit::search::{PixelFit, search_all};
use crate::fit::solution::TurnSolution;
use crate::fit::unknowns::Unknowns;
use crate::model::frame::{Elevation, TableFrame};
use crate::model::known_light::KnownLight;
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;

/// Parameters of the solver.
struct SolveParameters {
    /// Number of blocks, or of pixels, on which the gloss is fitted. By hand.
    pixels: usize,
    /// Rounds of the joint optimisation on blocks: before each, the normals are searched anywhere. By hand.
    joint_rounds: usize,
    /// Gauss-Newton steps in each of them. By hand.
    joint_steps: usize,
    /// Gauss-Newton steps of the joint optimisation in each robust round. By hand.
    robust_steps: usize,
    /// Rounds of robust weights. By hand.
    robust_rounds: usize,
    /// Quantile of the distances that measures the spread of albedos. By hand: spots of another colour count, a few
    /// pixels that went wrong do not.
    spread_quantile: f64,
    /// Where that quantile is, in standard deviations. Derived: of the absolute value of a normal distribution.
    spread_deviations: f64,
    /// Residual up to which a diffuse material fits the turn, over the energy of the variation. By hand.
    diffuse_residual: f64,
    /// Largest part of the diffuse residual with which metal is taken. Measured: the rendered sessions of
    /// docs/results/turns.md have 0.53 (bronze) and 0.63 (plastic).
    metal_part: f64,
}

const PARAMETERS: SolveParameters = SolveParameters {
    pixels: 2500,
    joint_rounds: 2,
    joint_steps: 8,
    robust_steps: 3,
    robust_rounds: 3,
    spread_quantile: 0.9,
    spread_deviations: 1.645,
    diffuse_residual: 0.03,
    metal_part: 0.58,
};

/// Finds the normals and albedo that fit the curves of a turn best in a light that was given or measured, in the viewer's
/// frame at the table's angle 0; bands up to 6 count.
///
/// Gloss is fitted on blocks of pixels, then every pixel by itself. Then parts of the turn with a large residual, shadows
/// and highlights, count less for that pixel, and it is fitted again. Where no material is given, the object is taken for
/// metal if that fits clearly better.
#[must_use]
pub fn solve_in_light(
    curves: &TurnCurves,
    light: &ShLight,
    elevation: Elevation,
    material: Option<MaterialKind>,
) -> TurnSolution {
    let frame = TableFrame::new(elevation);
    let known = KnownLight::new(light, &frame);
    let unknowns = |material| Unknowns {
        frame,
        known: &known,
        material,
    };
    let blocks = Blocks::new(curves);
    let (unknowns, model) = match material {
        Some(material) => {
            let unknowns = unknowns(material);
            (unknowns, blocks.model(unknowns))
        }
        None => {
            let tried = [MaterialKind::Diffuse, MaterialKind::Metal].map(unknowns);
            blocks.choose(tried)
        }
    };
    let conditioning = Conditioning::of(curves).in_given(&unknowns.initial());
    let statistics = all_statistics(curves);
    let mut solver = Solver {
        curves,
        unknowns,
        fits: search_all(&model, &statistics, None),
        model,
        statistics,
    };
    for _ in 0..PARAMETERS.robust_rounds {
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

/// A turn on blocks of pixels.
struct Blocks {
    statistics: Vec<CurveStatistics>,
}

impl Blocks {
    fn new(curves: &TurnCurves) -> Self {
        let pixels = curves.pixels() as f64 / PARAMETERS.pixels as f64;
        let side = (pixels.sqrt().ceil() as usize).max(1);
        Self {
            statistics: all_statistics(&curves.reduced(side)),
        }
    }

    /// The shading model that fits the blocks best.
    fn model(&self, unknowns: Unknowns<'_>) -> ShadingModel {
        let joint = JointOptimisation {
            statistics: &self.statistics,
            unknowns,
        };
        joint.found(
            unknowns.initial(),
            PARAMETERS.joint_rounds,
            PARAMETERS.joint_steps,
        )
    }

    /// The material that fits the blocks, and its shading model.
    fn choose<'a>(&self, [diffuse, metal]: [Unknowns<'a>; 2]) -> (Unknowns<'a>, ShadingModel) {
        let model = self.model(diffuse);
        let residual = self.residual(&model);
        if residual <= PARAMETERS.diffuse_residual {
            return (diffuse, model);
        }
        let of_metal = self.model(metal);
        if self.residual(&of_metal) < PARAMETERS.metal_part * residual {
            (metal, of_metal)
        } else {
            (diffuse, model)
        }
    }

    /// The residual of a curve, over the energy of its variation: the median over the blocks.
    fn residual(&self, model: &ShadingModel) -> f64 {
        let fits = search_all(model, &self.statistics, None);
        median(fits.iter().map(|fit| fit.residual)).unwrap_or(0.0)
    }
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
        let every = self.statistics.len().div_ceil(PARAMETERS.pixels).max(1);
        let statistics: Vec<CurveStatistics> =
            self.statistics.iter().step_by(every).copied().collect();
        let fits: Vec<PixelFit> = self.fits.iter().step_by(every).copied().collect();
        let near = search_all(&self.model, &statistics, Some(&fits));
        let joint = JointOptimisation {
            statistics: &statistics,
            unknowns: self.unknowns,
        };
        (self.model, _) = joint.refined(self.model, near, PARAMETERS.robust_steps);
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
            quantile(distances, PARAMETERS.spread_quantile).unwrap_or(0.0)
                / PARAMETERS.spread_deviations
        });
        let model = &self.model;
        self.fits
            .par_iter_mut()
            .zip(&self.statistics)
            .filter(|(_, statistics)| !statistics.is_dark())
            .for_each(|(fit, statistics)| {
                let harmonics = model.harmonics(fit.normal);
                fit.albedo = statistics.shrunk_albedo(
                    &harmonics,
                    (middle, spread),
                    ERROR_PARAMETERS.freedom,
                );
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
