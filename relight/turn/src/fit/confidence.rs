//! The angle by which each normal is expected to be off.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;
use relight_core::statistics::median;

use crate::fit::albedo::shared;
use crate::fit::curve_statistics::CurveStatistics;
use crate::fit::normal_step::PriorNormal;
use crate::fit::options::{TurnOptions, TurnPrior};
use crate::fit::search::{PixelFit, Search};
use crate::fit::smoothing::smoothed_normals;
use crate::model::directions::dot;
use crate::model::shading::ShadingModel;
use crate::observe::curves::TurnCurves;

/// Parameters of the expected errors.
pub(crate) struct ErrorParameters {
    /// Least smoothing of a map of normals, standard deviation in pixels. By hand.
    pub(crate) least_blur: f64,
    /// Standard deviation of a pixel's surroundings, in widths of the frame. By hand.
    pub(crate) surroundings: f64,
    /// Degrees of freedom of the residual of a curve. Measured: fitted to the angles that the standard deviation stands
    /// for.
    pub(crate) freedom: f64,
    /// Median residual from which differences to the surroundings are doubted in full, over the energy of the
    /// variation. By hand.
    pub(crate) relative_residual: f64,
    /// Error that all normals have in common in unknown light with a prior, radians: light makes up for it, and no
    /// residual shows it. By hand: 14 degrees.
    pub(crate) common_with_prior: f64,
    /// The same with the outline alone, radians. By hand: 20 degrees.
    pub(crate) common_alone: f64,
    /// Factor of what is expected of a prior normal beside the curves. Measured: with the next, on the 16 synthetic
    /// turns of seed 3001 (docs/results/turns.md).
    of_prior: f64,
    /// Factor of how far the curves lead away from it. Measured.
    of_shift: f64,
    /// The same in known light, radians, by shade in hollows and bounced light. By hand: 5 degrees.
    pub(crate) common_in_known_light: f64,
    /// Error of normals where the turn does not determine them, radians. By hand.
    pub(crate) unobservable: f64,
    /// Error of a normal nearly all of whose light is clipped, radians. By hand.
    pub(crate) clipped: f64,
}

pub(crate) const ERROR_PARAMETERS: ErrorParameters = ErrorParameters {
    least_blur: 0.6,
    surroundings: 1.0 / 40.0,
    freedom: 3.0,
    relative_residual: 0.005,
    common_with_prior: 0.25,
    common_alone: 0.35,
    of_prior: 1.1,
    of_shift: 0.65,
    common_in_known_light: 0.08,
    unobservable: 1.0,
    clipped: 0.8,
};

/// The pixels of a turn as they are fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FittedPixels<'a> {
    pub(crate) curves: &'a TurnCurves,
    pub(crate) statistics: &'a [CurveStatistics],
    pub(crate) prior: Option<&'a [PriorNormal]>,
    pub(crate) model: &'a ShadingModel,
    pub(crate) fits: &'a [PixelFit],
}

/// What a pixel's normal is expected to be off by itself, radians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OwnError {
    /// By what is left of its curve, and by what is clipped.
    deviation: f64,
    /// By how far it is from the normals around it.
    inconsistency: f64,
}

impl OwnError {
    /// With what all pixels have in common.
    pub(crate) fn with(&self, common: f64) -> f64 {
        self.deviation
            .hypot(self.inconsistency)
            .hypot(common)
            .min(FRAC_PI_2)
    }
}

/// What all normals of a turn are expected to be off, radians.
pub(crate) fn common_error(options: &TurnOptions, has_prior: bool, is_fit: bool) -> f64 {
    let has_errors = |prior: &TurnPrior| prior.expected_errors.is_some();
    let common = match &options.light {
        Some(_) => ERROR_PARAMETERS.common_in_known_light,
        // Each normal has its own.
        None if options.prior.as_ref().is_some_and(has_errors) => 0.0,
        None if has_prior => ERROR_PARAMETERS.common_with_prior,
        None => ERROR_PARAMETERS.common_alone,
    };
    let untold = if is_fit {
        0.0
    } else {
        ERROR_PARAMETERS.unobservable
    };
    common
        .hypot(options.elevation.uncertainty_deg().to_radians())
        .hypot(untold)
}

/// What normals are expected to be off, radians, where that was known of the prior: as much as was expected of the prior,
/// and more the further the curves lead away from it. Of a black pixel they say nothing, and it keeps what was expected.
pub(crate) fn errors_beside_prior(
    fits: &[PixelFit],
    prior: &[PriorNormal],
    common: f64,
) -> Vec<f64> {
    let pixels = fits.iter().zip(prior);
    pixels
        .map(|(fit, prior)| {
            let shift = dot(fit.normal, prior.normal).clamp(-1.0, 1.0).acos();
            let expected = (ERROR_PARAMETERS.of_prior * prior.sureness.powf(-0.5))
                .hypot(ERROR_PARAMETERS.of_shift * shift)
                .hypot(common);
            expected.min(FRAC_PI_2)
        })
        .collect()
}

/// What each pixel's normal is expected to be off by itself.
pub(crate) fn own_errors(pixels: FittedPixels<'_>) -> Vec<OwnError> {
    let FittedPixels {
        curves,
        statistics,
        prior,
        model,
        fits,
    } = pixels;
    let search = Search::new(model);
    let deviation = ERROR_PARAMETERS.surroundings * curves.extent().width as f64;
    let surroundings = smoothed_normals(
        curves,
        deviation.max(ERROR_PARAMETERS.least_blur),
        |pixel| fits[pixel].normal,
    );
    (0..fits.len())
        .into_par_iter()
        .map(|pixel| {
            let statistics = &statistics[pixel];
            if statistics.is_dark() {
                return OwnError {
                    deviation: FRAC_PI_2,
                    inconsistency: 0.0,
                };
            }
            let prior = prior.map(|all| all[pixel]);
            let fit = &fits[pixel];
            let deviation =
                search.standard_deviation(statistics, prior, fit, ERROR_PARAMETERS.freedom);
            let clipped = ERROR_PARAMETERS.clipped * curves.clipped_at(pixel);
            let inconsistency = dot(surroundings[pixel], fit.normal);
            OwnError {
                deviation: deviation.hypot(clipped),
                inconsistency: inconsistency.clamp(-1.0, 1.0).acos(),
            }
        })
        .collect()
}

/// The albedos, where normals are hardly to be trusted by those around them. A bent surface is not to be doubted where
/// the turn is explained.
pub(crate) fn shared_albedo(
    curves: &TurnCurves,
    fits: &[PixelFit],
    errors: &[OwnError],
) -> Vec<[f64; 3]> {
    let residual = median(fits.iter().map(|fit| fit.residual)).unwrap_or(0.0);
    let doubt = (residual / ERROR_PARAMETERS.relative_residual).min(1.0);
    let error = |own: &OwnError| own.deviation.hypot(doubt * own.inconsistency);
    let errors: Vec<f64> = errors.iter().map(error).collect();
    let albedo: Vec<[f64; 3]> = fits.iter().map(|fit| fit.albedo).collect();
    shared(curves, &albedo, &errors)
}
