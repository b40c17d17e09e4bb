//! Normals, albedo and light of a whole turn.

use rayon::prelude::*;
use relight_core::statistics::{median, quantile};

use crate::error::TurnError;
use crate::fit::albedo::toward_expected;
use crate::fit::blocks::{BLOCK_PARAMETERS, starts};
use crate::fit::confidence::{
    ERROR_PARAMETERS, FittedPixels, OwnError, common_error, errors_beside_prior, own_errors,
    shared_albedo,
};
use crate::fit::curve_statistics::{CurveStatistics, all_statistics};
use crate::fit::joint::JointOptimisation;
use crate::fit::normal_step::PriorNormal;
use crate::fit::options::TurnOptions;
use crate::fit::prior_mean::Initialised;
use crate::fit::prior_weight::PriorWeight;
use crate::fit::robust::robust_weights;
use crate::fit::search::{PixelFit, search_all};
use crate::fit::setting::Setting;
use crate::fit::solution::TurnSolution;
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;
use crate::observe::verdict::LightVerdict;

/// Parameters of the solver.
struct SolveParameters {
    /// Gauss-Newton steps of the joint optimisation in each robust round. By hand.
    robust_steps: usize,
    /// Rounds of robust weights. By hand.
    robust_rounds: usize,
    /// Quantile of the distances that measures the spread of albedos. By hand: spots of another colour count, a few
    /// pixels that went wrong do not.
    spread_quantile: f64,
    /// Where that quantile is, in standard deviations. Derived: of the absolute value of a normal distribution.
    spread_deviations: f64,
}

const PARAMETERS: SolveParameters = SolveParameters {
    robust_steps: 3,
    robust_rounds: 3,
    spread_quantile: 0.9,
    spread_deviations: 1.645,
};

/// Finds the normals, albedo and light that fit the curves of a turn best.
///
/// With a known light every pixel is solved by itself. With an unknown one, light and normals are found in
/// turns, from several initialisations, on blocks of pixels; the initialisation with the least residual is taken. Then
/// parts of the turn with a large residual, shadows and highlights, count less for that pixel, and it is fitted again.
///
/// # Errors
/// Where the prior has another size, or no light fits the curves: [`TurnError::Unfit`] where the exposure is why.
pub fn solve_turn(curves: &TurnCurves, options: &TurnOptions) -> Result<TurnSolution, TurnError> {
    let of_turn = Conditioning::of(curves);
    let initialised =
        Initialised::find(curves, options).map_err(|error| match (error, of_turn.verdict) {
            (
                TurnError::NoLight,
                verdict @ (LightVerdict::Overexposed | LightVerdict::Underexposed),
            ) => TurnError::Unfit(verdict),
            (error, _) => error,
        })?;
    let Initialised {
        prior,
        setting,
        found,
        is_prior_left_out,
        azimuth,
    } = initialised;
    let conditioning = match &setting.known {
        Some(known) => of_turn.in_given(&setting.unblurred(known, found.model.material)),
        None => of_turn,
    };
    let direction = if conditioning.verdict.is_fit() {
        setting.direction(curves, prior.as_deref(), &found)
    } else {
        None
    };
    let mut solver = Solver {
        curves,
        prior,
        model: found.model,
        setting,
        prior_weight: PriorWeight::of(options),
        statistics: all_statistics(curves),
        fits: Vec::new(),
    };
    let prior = solver.prior.as_deref();
    let near = prior.filter(|_| solver.setting.has_errors).map(starts);
    solver.fits = solver.search(near.as_deref());
    for _ in 0..PARAMETERS.robust_rounds {
        solver.refine();
    }
    solver.shrink_albedo();
    let conditioning = conditioning.in_found(solver.is_light_possible());
    let has_prior = options.prior.is_some() && !is_prior_left_out;
    let is_told =
        conditioning.verdict.is_fit() || solver.is_prior_told_beside(conditioning.verdict);
    let common = common_error(options, has_prior, is_told);
    let own_errors = solver.own_errors();
    if solver.setting.known.is_none() {
        solver.normalise();
    }
    let albedo = shared_albedo(curves, &solver.fits, &own_errors);
    let expected_errors = match solver.prior.as_deref() {
        Some(prior) if solver.setting.knows_errors_of_unknown_light() => {
            errors_beside_prior(&solver.fits, prior, common)
        }
        _ => own_errors.iter().map(|own| own.with(common)).collect(),
    };
    let albedo = match options
        .prior
        .as_ref()
        .and_then(|prior| prior.albedo.as_ref())
    {
        Some(expected) => toward_expected(curves, &albedo, expected, &expected_errors),
        None => albedo,
    };
    Ok(TurnSolution {
        has_prior,
        hypotheses: options
            .prior
            .as_ref()
            .and_then(|prior| prior.hypotheses.clone()),
        is_prior_left_out,
        azimuth,
        direction,
        given_material: options.material,
        albedo,
        fits: solver.fits,
        expected_errors,
        model: solver.model,
        elevation: options.elevation,
        measured: options.light.clone(),
        initialisations: found.initialisations,
        materials: found.materials,
        conditioning,
    })
}

/// All pixels under one light.
struct Solver<'a> {
    curves: &'a TurnCurves,
    prior: Option<Vec<PriorNormal>>,
    model: ShadingModel,
    setting: Setting,
    prior_weight: PriorWeight,
    statistics: Vec<CurveStatistics>,
    fits: Vec<PixelFit>,
}

impl Solver<'_> {
    /// The best normals near others, or anywhere.
    fn search(&self, near: Option<&[PixelFit]>) -> Vec<PixelFit> {
        search_all(&self.model, &self.statistics, self.prior.as_deref(), near)
    }

    /// Weights parts of the turn by their residuals, fits the light again, and then every pixel.
    fn refine(&mut self) {
        let (curves, model) = (self.curves, &self.model);
        self.statistics = (0..curves.pixels())
            .into_par_iter()
            .map(|pixel| {
                let robust_weights = robust_weights(curves, pixel, &self.fits[pixel], model);
                CurveStatistics::new(curves, pixel, Some(&robust_weights))
            })
            .collect();
        if let Some(prior) = self.prior.as_mut().filter(|_| self.setting.has_errors) {
            self.prior_weight.balance(prior, &self.fits);
        }
        let every = self
            .statistics
            .len()
            .div_ceil(BLOCK_PARAMETERS.pixels)
            .max(1);
        let statistics: Vec<CurveStatistics> =
            self.statistics.iter().step_by(every).copied().collect();
        let fits: Vec<PixelFit> = self.fits.iter().step_by(every).copied().collect();
        let prior = self.prior.as_ref();
        let prior: Option<Vec<PriorNormal>> =
            prior.map(|all| all.iter().step_by(every).copied().collect());
        let joint = JointOptimisation {
            statistics: &statistics,
            prior: prior.as_deref(),
            starts: None,
            unknowns: self.setting.unknowns_of(&self.model),
        };
        let near = search_all(&self.model, &statistics, joint.prior, Some(&fits));
        (self.model, _) = joint.refined(self.model, near, PARAMETERS.robust_steps);
        self.fits = self.search(Some(&self.fits));
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
            prior: self.prior.as_deref(),
            model: &self.model,
            fits: &self.fits,
        })
    }

    /// Whether a light that had to be found is nowhere negative. Metal shows only what it mirrors of it.
    fn is_light_possible(&self) -> bool {
        self.setting.known.is_some()
            || self.model.material == MaterialKind::Metal
            || self.model.light.is_possible()
    }

    /// Whether what is expected of the prior's normals holds all the same. A light that cannot be speaks against the light: on
    /// three of 40 synthetic turns with such a light the normals of the network of turns were as good as it expected.
    fn is_prior_told_beside(&self, verdict: LightVerdict) -> bool {
        verdict == LightVerdict::ImpossibleLight && self.setting.knows_errors_of_unknown_light()
    }

    /// Brings the mean shading of each channel to 1.
    fn normalise(&mut self) {
        let mut sums = [0.0; 3];
        for fit in &self.fits {
            let harmonics = self.model.harmonics(fit.normal);
            for (sum, harmonics) in sums.iter_mut().zip(harmonics.base) {
                *sum += harmonics[0];
            }
        }
        let factors = sums.map(|sum| {
            let mean = sum / self.fits.len() as f64;
            if mean > 1e-12 { mean } else { 1.0 }
        });
        let parts = factors.map(|factor| 1.0 / factor);
        self.model.light = self.model.light.times(parts);
        if self.model.material == MaterialKind::Metal {
            self.model.gloss = self.model.gloss.times(parts);
        }
        for fit in &mut self.fits {
            fit.albedo = [0, 1, 2].map(|c| fit.albedo[c] * factors[c]);
        }
    }
}

#[cfg(test)]
mod tests;
