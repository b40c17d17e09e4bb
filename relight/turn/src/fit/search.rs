//! The normal of one pixel: the one whose curve is nearest to what was seen.

use rayon::prelude::*;

use crate::fit::curve_statistics::{CurveStatistics, HarmonicProducts, sum_of_products};
use crate::fit::normal_step::{NormalDerivatives, QuadraticCost};
use crate::model::directions::{LEAST_FACING, half_sphere, tangents, tilted};
use crate::model::harmonics::COEFFICIENTS;
use crate::model::shading::{PixelHarmonics, ShadingModel};

/// Candidates over the visible half sphere. By hand: about 7 degrees apart.
const CANDIDATES: usize = 400;
/// How many of the best candidates are refined. By hand.
const REFINED: usize = 3;
/// Gauss-Newton steps of each of them before the best is taken. By hand.
const FIRST_STEPS: usize = 4;
/// Largest number of Gauss-Newton steps. By hand.
const STEPS: usize = 16;
/// Length of a step at which the refinement ends, radians. Numerical.
const LAST_STEP: f64 = 1e-4;
/// Step of the finite differences of the gradient, radians. Numerical.
const GRADIENT_STEP: f64 = 1e-4;
/// Step of the finite differences of the Hessian, radians. By hand.
const HESSIAN_STEP: f64 = 0.06;
/// Damping of the first step, relative to the trace of the Hessian (Levenberg-Marquardt). Numerical.
const DAMPING: f64 = 1e-3;
/// Factor of the damping after a step that lowers the cost. Numerical.
const DAMPING_FALL: f64 = 0.2;
/// Factor of the damping after one that does not. Numerical.
const DAMPING_RISE: f64 = 8.0;
/// Least eigenvalue of the Hessian: at a border of what is allowed it need not be positive. Numerical.
const LEAST_CURVATURE: f64 = 1e-3;

/// A pixel's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelFit {
    /// In the viewer's frame.
    pub(crate) normal: [f64; 3],
    pub(crate) albedo: [f64; 3],
    /// What is left of the curve, over the energy of its variation.
    pub(crate) residual: f64,
}

impl PixelFit {
    /// That of a pixel without light.
    pub(crate) const DARK: Self = Self {
        normal: [0.0, 0.0, 1.0],
        albedo: [0.0; 3],
        residual: 1.0,
    };
}

/// Candidate normals under a shading model.
pub(crate) struct Search<'a> {
    model: &'a ShadingModel,
    tried: Vec<Tried>,
}

struct Tried {
    normal: [f64; 3],
    harmonics: PixelHarmonics,
    products: HarmonicProducts,
}

impl<'a> Search<'a> {
    pub(crate) fn new(model: &'a ShadingModel) -> Self {
        let tried = half_sphere(CANDIDATES).map(|normal| {
            let harmonics = model.harmonics(normal);
            Tried {
                normal,
                harmonics,
                products: HarmonicProducts::of(&harmonics),
            }
        });
        Self {
            model,
            tried: tried.collect(),
        }
    }

    /// The best normal anywhere.
    pub(crate) fn anywhere(&self, statistics: &CurveStatistics) -> PixelFit {
        let mut best = [(f64::INFINITY, [0.0, 0.0, 1.0]); REFINED];
        for tried in &self.tried {
            let cost = statistics.residual(&tried.harmonics, &tried.products);
            if cost < best[REFINED - 1].0 {
                insert(&mut best, (cost, tried.normal));
            }
        }
        let refined = best.map(|(_, start)| self.downhill(statistics, start, FIRST_STEPS));
        let [first, rest @ ..] = refined;
        let (start, _) = rest.into_iter().fold(
            first,
            |best, other| {
                if other.1 < best.1 { other } else { best }
            },
        );
        self.near(statistics, start)
    }

    /// The best normal that is reached from `start` downhill.
    pub(crate) fn near(&self, statistics: &CurveStatistics, start: [f64; 3]) -> PixelFit {
        let (normal, _) = self.downhill(statistics, start, STEPS);
        PixelFit {
            normal,
            albedo: statistics.albedo(&self.model.harmonics(normal)),
            residual: self.residual(statistics, normal),
        }
    }

    /// Where so many steps lead, and what it costs there: Gauss-Newton steps, damped as by Levenberg-Marquardt,
    /// with the albedo at its best for each normal.
    fn downhill(
        &self,
        statistics: &CurveStatistics,
        start: [f64; 3],
        steps: usize,
    ) -> ([f64; 3], f64) {
        let cost = |normal| self.residual(statistics, normal);
        let mut normal = start;
        let mut least = cost(normal);
        let mut damping = DAMPING;
        for _ in 0..steps {
            let axes = tangents(normal);
            let quadratic = self.quadratic(statistics, normal, axes);
            let step = quadratic.step(damping);
            let other = tilted(normal, axes, step);
            let found = cost(other);
            let length = step[0].hypot(step[1]);
            if other[2] >= LEAST_FACING && found < least {
                (normal, least) = (other, found);
                damping *= DAMPING_FALL;
            } else {
                damping *= DAMPING_RISE;
            }
            if length < LAST_STEP {
                break;
            }
        }
        (normal, least)
    }

    /// How the cost changes as a normal leans.
    fn quadratic(
        &self,
        statistics: &CurveStatistics,
        normal: [f64; 3],
        axes: [[f64; 3]; 2],
    ) -> QuadraticCost {
        let derivatives = self.derivatives(statistics, normal, axes);
        let mut quadratic = QuadraticCost::default();
        for (channel, jacobian) in derivatives.jacobian.iter().enumerate() {
            quadratic.add(statistics, channel, jacobian, &derivatives.seen[channel]);
        }
        quadratic.scale(statistics.unit());
        quadratic
    }

    /// How the harmonics of a pixel change as its normal leans.
    pub(crate) fn derivatives(
        &self,
        statistics: &CurveStatistics,
        normal: [f64; 3],
        [u, v]: [[f64; 3]; 2],
    ) -> NormalDerivatives {
        let here = self.model.harmonics(normal);
        let albedo = statistics.albedo(&here);
        let there = [[GRADIENT_STEP, 0.0], [0.0, GRADIENT_STEP]]
            .map(|step| self.model.harmonics(tilted(normal, [u, v], step)));
        let base = here.base;
        let seen: [_; 3] = std::array::from_fn(|c| sum(&base[c], albedo[c], &here.gloss[c]));
        let jacobian = std::array::from_fn(|c| {
            let along = statistics.times(c, &base[c]);
            let own = sum_of_products(&base[c], &along);
            there.map(|there| {
                let moved = sum(&there.base[c], albedo[c], &there.gloss[c]);
                let mut column: [f64; COEFFICIENTS] =
                    std::array::from_fn(|i| (moved[i] - seen[c][i]) / GRADIENT_STEP);
                // The albedo follows the normal.
                if own > 1e-12 && albedo[c] > 0.0 {
                    let share = sum_of_products(&column, &along) / own;
                    column
                        .iter_mut()
                        .zip(&base[c])
                        .for_each(|(column, base)| *column -= share * base);
                }
                column
            })
        });
        NormalDerivatives {
            albedo,
            base,
            seen,
            jacobian,
        }
    }

    /// The residual of a normal.
    pub(crate) fn residual(&self, statistics: &CurveStatistics, normal: [f64; 3]) -> f64 {
        let harmonics = self.model.harmonics(normal);
        statistics.residual(&harmonics, &HarmonicProducts::of(&harmonics))
    }

    /// How far the normal may lean before the residual grows by as much as it is: the standard deviation of
    /// the angle, radians, were the residual of the curve noise of `freedom` degrees of freedom.
    pub(crate) fn standard_deviation(
        &self,
        statistics: &CurveStatistics,
        fit: &PixelFit,
        freedom: f64,
    ) -> f64 {
        let [u, v] = tangents(fit.normal);
        let cost = |a: f64, b: f64| {
            let normal = tilted(fit.normal, [u, v], [a, b]);
            self.residual(statistics, normal)
        };
        let h = HESSIAN_STEP;
        let middle = cost(0.0, 0.0);
        let uu = (cost(h, 0.0) + cost(-h, 0.0) - 2.0 * middle) / (h * h);
        let vv = (cost(0.0, h) + cost(0.0, -h) - 2.0 * middle) / (h * h);
        let uv = (cost(h, h) - cost(h, -h) - cost(-h, h) + cost(-h, -h)) / (4.0 * h * h);
        // The eigenvalues of the Hessian, which at a border of what is allowed need not be positive.
        let (half, rest) = (
            (uu + vv) / 2.0,
            (((uu - vv) / 2.0).powi(2) + uv * uv).sqrt(),
        );
        let inverse: f64 = [half + rest, half - rest]
            .into_iter()
            .map(|eigenvalue| 1.0 / eigenvalue.max(LEAST_CURVATURE))
            .sum();
        (2.0 * fit.residual / freedom * inverse).sqrt()
    }
}

fn sum(
    base: &[f64; COEFFICIENTS],
    albedo: f64,
    gloss: &[f64; COEFFICIENTS],
) -> [f64; COEFFICIENTS] {
    std::array::from_fn(|i| albedo * base[i] + gloss[i])
}

/// Puts one of less cost in its place, and the last one out.
fn insert(best: &mut [(f64, [f64; 3]); REFINED], one: (f64, [f64; 3])) {
    best[REFINED - 1] = one;
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
}

/// The best normals of all pixels: near those of other fits, or anywhere.
pub(crate) fn search_all(
    model: &ShadingModel,
    statistics: &[CurveStatistics],
    near: Option<&[PixelFit]>,
) -> Vec<PixelFit> {
    let search = Search::new(model);
    statistics
        .par_iter()
        .enumerate()
        .map(|(pixel, statistics)| {
            if statistics.is_dark() {
                return PixelFit::DARK;
            }
            match near {
                Some(fits) => search.near(statistics, fits[pixel].normal),
                None => search.anywhere(statistics),
            }
        })
        .collect()
}

/// The residual of the curves, the mean over the pixels.
pub(crate) fn cost(fits: &[PixelFit]) -> f64 {
    let sum: f64 = fits.iter().map(|fit| fit.residual.min(1.0)).sum();
    sum / fits.len().max(1) as f64
}
