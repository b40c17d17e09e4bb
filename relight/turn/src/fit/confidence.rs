//! The angle by which each normal is expected to be off.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;
use relight_core::statistics::median;

use crate::fit::albedo::shared;
use crate::fit::curve_statistics::Moments;
use crate::fit::normal_step::Expected;
use crate::fit::options::TurnOptions;
use crate::fit::search::{PixelFit, Search};
use crate::fit::smoothing::smoothed_normals;
use crate::model::directions::dot;
use crate::model::shading::Room;
use crate::observe::curves::TurnCurves;

/// The least smoothing of a map of normals, pixels.
const LEAST_BLUR: f64 = 0.6;

/// How far the surroundings of a pixel reach, in parts of the frame's width: a normal that differs from theirs is not to be
/// believed as far.
const SURROUNDINGS: f64 = 1.0 / 40.0;

/// Degrees of freedom of what is left of a curve: fitted to the angles that its looseness stands for.
pub(crate) const FREEDOM: f64 = 3.0;

/// A turn of which the median pixel leaves this much is not explained so well that bends of the surface are real.
const UNEXPLAINED: f64 = 0.005;

/// How far normals are off as a whole in unknown light, radians: a bend that light makes up for, which no residual
/// shows. With a prior, and without.
const BENT_WITH_PRIOR: f64 = 0.25;

const BENT_ALONE: f64 = 0.35;

/// What shade in hollows and bounced light do to normals in known light, radians.
const BENT_IN_KNOWN_LIGHT: f64 = 0.08;

/// How far normals are off where the turn does not tell them, radians.
const UNTOLD: f64 = 1.0;

/// How far a normal is off where nearly all of its light is clipped, radians.
const CLIPPED_ERROR: f64 = 0.8;

/// The pixels of a turn as they are fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FittedPixels<'a> {
    pub(crate) curves: &'a TurnCurves,
    pub(crate) moments: &'a [Moments],
    pub(crate) expected: Option<&'a [Expected]>,
    pub(crate) room: &'a Room,
    pub(crate) fits: &'a [PixelFit],
}

/// What a pixel's normal is expected to be off by itself, radians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OwnError {
    /// By what is left of its curve, and by what is clipped.
    loose: f64,
    /// By how far it is from the normals around it.
    bent: f64,
}

impl OwnError {
    /// With what all pixels have in common.
    pub(crate) fn with(&self, common: f64) -> f64 {
        self.loose.hypot(self.bent).hypot(common).min(FRAC_PI_2)
    }
}

/// What all normals of a turn are expected to be off, radians.
pub(crate) fn common_error(options: &TurnOptions, has_prior: bool, is_fit: bool) -> f64 {
    let common = match &options.light {
        Some(_) => BENT_IN_KNOWN_LIGHT,
        None if has_prior => BENT_WITH_PRIOR,
        None => BENT_ALONE,
    };
    let untold = if is_fit { 0.0 } else { UNTOLD };
    common
        .hypot(options.elevation.uncertainty_deg().to_radians())
        .hypot(untold)
}

/// What each pixel's normal is expected to be off by itself.
pub(crate) fn own_errors(pixels: FittedPixels<'_>) -> Vec<OwnError> {
    let FittedPixels {
        curves,
        moments,
        expected,
        room,
        fits,
    } = pixels;
    let search = Search::new(room);
    let deviation = SURROUNDINGS * curves.extent().width as f64;
    let surroundings = smoothed_normals(curves, deviation.max(LEAST_BLUR), |pixel| {
        fits[pixel].normal
    });
    (0..fits.len())
        .into_par_iter()
        .map(|pixel| {
            let moments = &moments[pixel];
            if moments.is_dark() {
                return OwnError {
                    loose: FRAC_PI_2,
                    bent: 0.0,
                };
            }
            let expected = expected.map(|all| all[pixel]);
            let fit = &fits[pixel];
            let loose = search.looseness(moments, expected, fit, FREEDOM);
            let clipped = CLIPPED_ERROR * curves.clipped_at(pixel);
            let bent = dot(surroundings[pixel], fit.normal);
            OwnError {
                loose: loose.hypot(clipped),
                bent: bent.clamp(-1.0, 1.0).acos(),
            }
        })
        .collect()
}

/// The albedos, where normals are hardly to be believed by those around them. A bent surface is not to be doubted where the
/// turn is explained.
pub(crate) fn shared_albedo(
    curves: &TurnCurves,
    fits: &[PixelFit],
    errors: &[OwnError],
) -> Vec<[f64; 3]> {
    let left = median(fits.iter().map(|fit| fit.residual)).unwrap_or(0.0);
    let doubt = (left / UNEXPLAINED).min(1.0);
    let error = |own: &OwnError| own.loose.hypot(doubt * own.bent);
    let errors: Vec<f64> = errors.iter().map(error).collect();
    let albedo: Vec<[f64; 3]> = fits.iter().map(|fit| fit.albedo).collect();
    shared(curves, &albedo, &errors)
}
