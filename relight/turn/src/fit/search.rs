//! The normal of one pixel: the one whose curve is nearest to the observed one.

use rayon::prelude::*;

use crate::fit::curve_statistics::{CurveStatistics, HarmonicProducts};
use crate::model::directions::{MIN_FACING, half_sphere, tangents, tilted};
use crate::model::shading::{PixelHarmonics, ShadingModel};

/// Candidates over the visible half sphere. By hand: about 7 degrees apart.
const CANDIDATES: usize = 400;
/// How many of the best candidates are refined. By hand.
const REFINED: usize = 3;
/// First step of a refinement, radians. By hand: half the distance of candidates.
const FIRST_STEP: f64 = 0.06;
/// Step at which the best candidate is chosen, radians. By hand.
const ROUGH_STEP: f64 = 0.01;
/// Step at which a refinement ends, radians. Numerical.
const LAST_STEP: f64 = 2e-4;
/// Where a step may lead.
const AROUND: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [-1.0, 0.0],
    [0.0, 1.0],
    [0.0, -1.0],
    [0.7, 0.7],
    [-0.7, 0.7],
    [0.7, -0.7],
    [-0.7, -0.7],
];
/// Step of the finite differences of the Hessian, radians. By hand.
const HESSIAN_STEP: f64 = 0.06;
/// Least eigenvalue of the Hessian: at a border of what is allowed it need not be positive. Numerical.
const MIN_CURVATURE: f64 = 1e-3;

/// The fit of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelFit {
    /// In the viewer's frame.
    pub(crate) normal: [f64; 3],
    pub(crate) albedo: [f64; 3],
    /// The residual of the curve, over the energy of its variation.
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
                products: HarmonicProducts::from_harmonics(&harmonics),
            }
        });
        Self {
            model,
            tried: tried.collect(),
        }
    }

    /// The best normal anywhere.
    pub(crate) fn best_of_all(&self, statistics: &CurveStatistics) -> PixelFit {
        let mut costs: Vec<(f64, [f64; 3])> = (self.tried.iter())
            .map(|tried| {
                let cost = statistics.residual(&tried.harmonics, &tried.products);
                (cost, tried.normal)
            })
            .collect();
        costs.select_nth_unstable_by(REFINED, |a, b| a.0.total_cmp(&b.0));
        let refined = costs[..REFINED].iter();
        let refined =
            refined.map(|&start| self.downhill(statistics, start, [FIRST_STEP, ROUGH_STEP]));
        let best = refined.min_by(|a, b| a.0.total_cmp(&b.0));
        let best = best.unwrap_or((f64::INFINITY, [0.0, 0.0, 1.0]));
        self.fit(statistics, best, ROUGH_STEP)
    }

    /// The best normal that is reached from `start` downhill.
    fn near(&self, statistics: &CurveStatistics, start: [f64; 3]) -> PixelFit {
        let start = (self.residual(statistics, start), start);
        self.fit(statistics, start, FIRST_STEP)
    }

    fn fit(&self, statistics: &CurveStatistics, start: (f64, [f64; 3]), step: f64) -> PixelFit {
        let (residual, normal) = self.downhill(statistics, start, [step, LAST_STEP]);
        PixelFit {
            normal,
            albedo: statistics.albedo(&self.model.harmonics(normal)),
            residual,
        }
    }

    /// Residual and normal where steps lead that become shorter where none leads further down, with the albedo at its best
    /// for each normal.
    fn downhill(
        &self,
        statistics: &CurveStatistics,
        (mut least, mut normal): (f64, [f64; 3]),
        [mut step, last]: [f64; 2],
    ) -> (f64, [f64; 3]) {
        while step > last {
            let axes = tangents(normal);
            let around = AROUND.map(|to| tilted(normal, axes, to.map(|part| step * part)));
            let visible = around.into_iter().filter(|to| to[2] >= MIN_FACING);
            let costs = visible.map(|to| (self.residual(statistics, to), to));
            match costs.min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some((cost, to)) if cost < least => (least, normal) = (cost, to),
                _ => step /= 2.0,
            }
        }
        (least, normal)
    }

    /// The mean residual of the best candidates of all pixels.
    pub(crate) fn cost(&self, all: &[CurveStatistics]) -> f64 {
        let least = |statistics: &CurveStatistics| self.best_of_all(statistics).residual.min(1.0);
        let costs: Vec<f64> = all.par_iter().map(least).collect();
        costs.iter().sum::<f64>() / all.len().max(1) as f64
    }

    /// The residual of a normal.
    pub(crate) fn residual(&self, statistics: &CurveStatistics, normal: [f64; 3]) -> f64 {
        let harmonics = self.model.harmonics(normal);
        statistics.residual(&harmonics, &HarmonicProducts::from_harmonics(&harmonics))
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
            .map(|eigenvalue| 1.0 / eigenvalue.max(MIN_CURVATURE))
            .sum();
        (2.0 * fit.residual / freedom * inverse).sqrt()
    }
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
                None => search.best_of_all(statistics),
            }
        })
        .collect()
}
