//! Joint optimisation of gloss, normals and albedo by Gauss-Newton steps, in which every pixel follows the gloss.
//!
//! A step takes out of what the unknowns do to a curve the part that the pixel's own normal and albedo could do as well:
//! the Schur complement of the normal equations.

use rayon::prelude::*;
use relight_core::statistics::median;

use crate::fit::curve_statistics::CurveStatistics;
use crate::fit::schur::JointEquations;
use crate::fit::search::{PixelFit, Search, cost, search_all};
use crate::fit::unknowns::Unknowns;
use crate::model::shading::ShadingModel;

/// Damping of the first step, relative to the diagonal (Levenberg-Marquardt). Numerical.
const DAMPING: f64 = 1e-3;
/// Factor of the damping after a step that lowers the cost. Numerical.
const DAMPING_FALL: f64 = 0.2;
/// Factor of the damping after one that does not. Numerical.
const DAMPING_RISE: f64 = 10.0;
/// Damping at which the steps end. Numerical.
const MOST_DAMPING: f64 = 1e3;
/// Relative gain of a step below which the steps end. Numerical.
const SETTLED: f64 = 2e-3;
/// Pixels that one task adds up. Fixed, so that sums do not depend on the number of threads.
const CHUNK: usize = 128;
/// Residual at which a pixel counts one quarter, in medians. By hand.
const OUTLIER: f64 = 4.0;
/// Least residual that is taken for the median, over the energy of the variation. Numerical.
const LEAST_MEDIAN: f64 = 1e-3;

/// Pixels whose shading model is fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointOptimisation<'a> {
    pub(crate) statistics: &'a [CurveStatistics],
    pub(crate) unknowns: Unknowns<'a>,
}

impl JointOptimisation<'_> {
    /// The shading model of the least residual. Each round searches the normals anywhere, then refines all unknowns.
    pub(crate) fn found(&self, start: ShadingModel, rounds: usize, steps: usize) -> ShadingModel {
        let mut model = start;
        let mut residual = f64::INFINITY;
        for _ in 0..rounds {
            let fits = search_all(&model, self.statistics, None);
            let (found, fits) = self.refined(model, fits, steps);
            let reached = cost(&fits);
            if reached < residual {
                (model, residual) = (found, reached);
            }
        }
        model
    }

    /// Shading model and pixels after at most so many steps from these.
    pub(crate) fn refined(
        &self,
        model: ShadingModel,
        fits: Vec<PixelFit>,
        steps: usize,
    ) -> (ShadingModel, Vec<PixelFit>) {
        let (mut estimate, mut fits) = (self.unknowns.estimate(&model), fits);
        let mut damping = DAMPING;
        let mut least = cost(&fits);
        for _ in 0..steps {
            let model = self.unknowns.model(&estimate);
            let Some(step) = self.step(&model, &fits, damping) else {
                break;
            };
            let other = self.unknowns.moved(&estimate, &step);
            let model = self.unknowns.model(&other);
            let found = search_all(&model, self.statistics, Some(&fits));
            let reached = cost(&found);
            if reached < least {
                let gain = (least - reached) / least;
                (estimate, fits, least) = (other, found, reached);
                damping *= DAMPING_FALL;
                if gain < SETTLED {
                    break;
                }
            } else {
                damping *= DAMPING_RISE;
                if damping > MOST_DAMPING {
                    break;
                }
            }
        }
        (self.unknowns.model(&estimate), fits)
    }

    /// How the unknowns should change.
    fn step(&self, model: &ShadingModel, fits: &[PixelFit], damping: f64) -> Option<Vec<f64>> {
        let weights = weights(fits);
        let (unknowns, count) = (&self.unknowns, self.unknowns.count());
        let search = Search::new(model);
        let sums = (0..fits.len().div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut sums = JointEquations::new(count);
                let pixels = chunk * CHUNK..((chunk + 1) * CHUNK).min(fits.len());
                for pixel in pixels.filter(|&pixel| !self.statistics[pixel].is_dark()) {
                    let one = (&self.statistics[pixel], fits[pixel].normal);
                    sums.add_pixel(&search, unknowns, one, weights[pixel]);
                }
                sums
            })
            .reduce(|| JointEquations::new(count), JointEquations::plus);
        sums.solve(damping)
    }
}

/// How much the energy that is left of each pixel's curve counts, so that bright pixels, which stand out of the noise,
/// count more: less where the model does not explain it.
fn weights(fits: &[PixelFit]) -> Vec<f64> {
    let median = median(fits.iter().map(|fit| fit.residual))
        .unwrap_or(0.0)
        .max(LEAST_MEDIAN);
    let weight = |fit: &PixelFit| {
        let size = fit.residual / (OUTLIER * median);
        1.0 / (1.0 + size).powi(2)
    };
    fits.iter().map(weight).collect()
}
