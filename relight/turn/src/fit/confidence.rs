//! The angle by which each normal is expected to be off in known light.

use std::f64::consts::FRAC_PI_2;

use rayon::prelude::*;
use relight_core::image::Extent;
use relit_data::statistics::median;

use crate::fit::albedo::shared;
use crate::fit::curve_statistics::CurveStatistics;
use crate::fit::search::{PixelFit, Search};
use crate::model::directions::{dot, unit};
use crate::model::frame::Elevation;
use crate::model::shading::ShadingModel;
use crate::observe::curves::TurnCurves;

/// Cells across the frame whose mean normals are a pixel's surroundings. By hand.
const CELLS: usize = 20;
/// Degrees of freedom of the residual of a curve. Measured: fitted to the angles that the standard deviation stands
/// for.
pub(crate) const FREEDOM: f64 = 3.0;
/// Median residual from which differences to the surroundings are doubted in full, over the energy of the
/// variation. By hand.
const RELATIVE_RESIDUAL: f64 = 0.005;
/// Error that all normals have in common, radians, by shade in hollows and bounced light. By hand: 5 degrees.
const COMMON: f64 = 0.08;
/// Error of normals where the turn does not determine them, radians. By hand.
pub(crate) const UNOBSERVABLE: f64 = 1.0;
/// Error of a normal whose light is nearly all clipped, radians. By hand.
const CLIPPED: f64 = 0.8;

/// The pixels of a turn as they are fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FittedPixels<'a> {
    pub(crate) curves: &'a TurnCurves,
    pub(crate) statistics: &'a [CurveStatistics],
    pub(crate) model: &'a ShadingModel,
    pub(crate) fits: &'a [PixelFit],
}

/// The expected error of a pixel's normal alone, radians.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NormalUncertainty {
    /// From its curve's residual, and from its clipped part.
    deviation: f64,
    /// By how far it is from the normals around it.
    inconsistency: f64,
}

impl NormalUncertainty {
    /// With what all pixels have in common.
    pub(crate) fn with(&self, common: f64) -> f64 {
        self.deviation
            .hypot(self.inconsistency)
            .hypot(common)
            .min(FRAC_PI_2)
    }
}

/// The expected error of all normals of a turn, radians.
pub(crate) fn common_error(elevation: Elevation, is_fit: bool) -> f64 {
    let unobservable = if is_fit { 0.0 } else { UNOBSERVABLE };
    COMMON
        .hypot(elevation.uncertainty_deg().to_radians())
        .hypot(unobservable)
}

/// The expected error of each pixel's normal alone.
pub(crate) fn normal_uncertainties(pixels: FittedPixels<'_>) -> Vec<NormalUncertainty> {
    let FittedPixels {
        curves,
        statistics,
        model,
        fits,
    } = pixels;
    let search = Search::new(model);
    let normals = curves.map(|pixel| fits[pixel].normal.map(|v| v as f32));
    let Extent { width, height } = curves.extent();
    let coarse = [
        CELLS.min(width),
        (CELLS * height).div_ceil(width).min(height),
    ];
    let around = normals.resized(Extent::new(coarse[0], coarse[1]));
    let around = around.resized(curves.extent());
    let surroundings: Vec<[f64; 3]> = curves.pixels_of(&around).map(unit).collect();
    (0..fits.len())
        .into_par_iter()
        .map(|pixel| {
            let statistics = &statistics[pixel];
            if statistics.is_dark() {
                return NormalUncertainty {
                    deviation: FRAC_PI_2,
                    inconsistency: 0.0,
                };
            }
            let fit = &fits[pixel];
            let deviation = search.standard_deviation(statistics, fit, FREEDOM);
            let clipped = CLIPPED * curves.clipped_at(pixel);
            let inconsistency = dot(surroundings[pixel], fit.normal);
            NormalUncertainty {
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
    errors: &[NormalUncertainty],
) -> Vec<[f64; 3]> {
    let residual = median(fits.iter().map(|fit| fit.residual)).unwrap_or(0.0);
    let doubt = (residual / RELATIVE_RESIDUAL).min(1.0);
    let error = |own: &NormalUncertainty| own.deviation.hypot(doubt * own.inconsistency);
    let errors: Vec<f64> = errors.iter().map(error).collect();
    let albedo: Vec<[f64; 3]> = fits.iter().map(|fit| fit.albedo).collect();
    shared(curves, &albedo, &errors)
}
