//! The normal of one pixel: the one whose curve is nearest to what was seen.

use crate::fit::curve_statistics::sum_of_products;
use rayon::prelude::*;

use crate::fit::curve_statistics::{Moments, WaveProducts};
use crate::fit::normal_step::{Expected, Leaning, Slope};
use crate::model::directions::{LEAST_FACING, dot, half_sphere, leant, tangents};
use crate::model::harmonics::WAVES;
use crate::model::shading::{PixelWaves, Room};

/// Parameters of the search for a normal.
struct SearchParameters {
    /// Candidates over the visible half sphere. By hand: about 7 degrees apart.
    candidates: usize,
    /// How many of the best candidates are refined. By hand.
    refined: usize,
    /// Gauss-Newton steps of each of them before the best is taken. By hand.
    first_steps: usize,
    /// Largest number of Gauss-Newton steps. By hand.
    steps: usize,
    /// Length of a step at which the refinement ends, radians. Numerical.
    last_step: f64,
    /// Step of the finite differences of the gradient, radians. Numerical.
    gradient_step: f64,
    /// Step of the finite differences of the Hessian, radians. By hand.
    hessian_step: f64,
    /// Damping of the first step, relative to the trace of the Hessian (Levenberg-Marquardt). Numerical.
    damping: f64,
    /// Factor of the damping after a step that lowers the cost. Numerical.
    damping_fall: f64,
    /// Factor of the damping after one that does not. Numerical.
    damping_rise: f64,
    /// Least eigenvalue of the Hessian: at a border of what is allowed it need not be positive. Numerical.
    least_curvature: f64,
}

const PARAMETERS: SearchParameters = SearchParameters {
    candidates: 400,
    refined: 3,
    first_steps: 4,
    steps: 16,
    last_step: 1e-4,
    gradient_step: 1e-4,
    hessian_step: 0.06,
    damping: 1e-3,
    damping_fall: 0.2,
    damping_rise: 8.0,
    least_curvature: 1e-3,
};

/// A pixel's answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PixelFit {
    /// In the viewer's frame.
    pub(crate) normal: [f64; 3],
    pub(crate) albedo: [f64; 3],
    /// What is left of the curve, over the energy of its variation.
    pub(crate) residual: f64,
}

/// The normals that are tried in a room.
pub(crate) struct Search<'a> {
    room: &'a Room,
    tried: Vec<Tried>,
}

struct Tried {
    normal: [f64; 3],
    waves: PixelWaves,
    products: WaveProducts,
}

impl<'a> Search<'a> {
    pub(crate) fn new(room: &'a Room) -> Self {
        let tried = half_sphere(PARAMETERS.candidates).map(|normal| {
            let waves = room.waves(normal);
            Tried {
                normal,
                waves,
                products: WaveProducts::of(&waves),
            }
        });
        Self {
            room,
            tried: tried.collect(),
        }
    }

    /// The best normal anywhere.
    pub(crate) fn anywhere(&self, moments: &Moments, expected: Option<Expected>) -> PixelFit {
        let mut best = [(f64::INFINITY, [0.0, 0.0, 1.0]); PARAMETERS.refined];
        for tried in &self.tried {
            let cost =
                moments.residual(&tried.waves, &tried.products) + bias(expected, tried.normal);
            if cost < best[PARAMETERS.refined - 1].0 {
                insert(&mut best, (cost, tried.normal));
            }
        }
        let refined =
            best.map(|(_, start)| self.downhill(moments, expected, start, PARAMETERS.first_steps));
        let [first, rest @ ..] = refined;
        let (start, _) = rest.into_iter().fold(
            first,
            |best, other| {
                if other.1 < best.1 { other } else { best }
            },
        );
        self.near(moments, expected, start)
    }

    /// The best normal that is reached from `start` downhill.
    pub(crate) fn near(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        start: [f64; 3],
    ) -> PixelFit {
        let (normal, _) = self.downhill(moments, expected, start, PARAMETERS.steps);
        PixelFit {
            normal,
            albedo: moments.albedo(&self.room.waves(normal)),
            residual: self.residual(moments, normal),
        }
    }

    /// Where so many steps lead, and what it costs there: Gauss and Newton's steps, damped as Levenberg and Marquardt do,
    /// with the albedo at its best for each normal.
    fn downhill(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        start: [f64; 3],
        steps: usize,
    ) -> ([f64; 3], f64) {
        let cost = |normal| self.residual(moments, normal) + bias(expected, normal);
        let mut normal = start;
        let mut least = cost(normal);
        let mut damping = PARAMETERS.damping;
        for _ in 0..steps {
            let axes = tangents(normal);
            let slope = self.slope(moments, expected, normal, axes);
            let step = slope.step(damping);
            let other = leant(normal, axes, step);
            let found = cost(other);
            let length = step[0].hypot(step[1]);
            if other[2] >= LEAST_FACING && found < least {
                (normal, least) = (other, found);
                damping *= PARAMETERS.damping_fall;
            } else {
                damping *= PARAMETERS.damping_rise;
            }
            if length < PARAMETERS.last_step {
                break;
            }
        }
        (normal, least)
    }

    /// How the cost changes as a normal leans.
    fn slope(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        normal: [f64; 3],
        axes: [[f64; 3]; 2],
    ) -> Slope {
        let leaning = self.leaning(moments, normal, axes);
        let mut slope = Slope::default();
        for (channel, ways) in leaning.ways.iter().enumerate() {
            slope.add(moments, channel, ways, &leaning.seen[channel]);
        }
        slope.scale(moments.unit());
        if let Some(expected) = expected {
            slope.lean(expected, normal, axes);
        }
        slope
    }

    /// How the waves of a pixel change as its normal leans.
    pub(crate) fn leaning(
        &self,
        moments: &Moments,
        normal: [f64; 3],
        [u, v]: [[f64; 3]; 2],
    ) -> Leaning {
        let here = self.room.waves(normal);
        let albedo = moments.albedo(&here);
        let there = [
            [PARAMETERS.gradient_step, 0.0],
            [0.0, PARAMETERS.gradient_step],
        ]
        .map(|step| self.room.waves(leant(normal, [u, v], step)));
        let body = here.body;
        let seen: [_; 3] = std::array::from_fn(|c| sum(&body[c], albedo[c], &here.gloss[c]));
        let ways = std::array::from_fn(|c| {
            let along = moments.times(c, &body[c]);
            let own = sum_of_products(&body[c], &along);
            there.map(|there| {
                let moved = sum(&there.body[c], albedo[c], &there.gloss[c]);
                let mut way: [f64; WAVES] =
                    std::array::from_fn(|i| (moved[i] - seen[c][i]) / PARAMETERS.gradient_step);
                // The albedo follows the normal.
                if own > 1e-12 && albedo[c] > 0.0 {
                    let share = sum_of_products(&way, &along) / own;
                    way.iter_mut()
                        .zip(&body[c])
                        .for_each(|(way, body)| *way -= share * body);
                }
                way
            })
        });
        Leaning {
            albedo,
            body,
            seen,
            ways,
        }
    }

    /// What a normal leaves of a curve.
    pub(crate) fn residual(&self, moments: &Moments, normal: [f64; 3]) -> f64 {
        let waves = self.room.waves(normal);
        moments.residual(&waves, &WaveProducts::of(&waves))
    }

    /// How far the normal may lean before the residual grows by as much as it is: the standard deviation of
    /// the angle, radians, were what is left of the curve noise of `freedom` degrees of freedom.
    pub(crate) fn looseness(
        &self,
        moments: &Moments,
        expected: Option<Expected>,
        fit: &PixelFit,
        freedom: f64,
    ) -> f64 {
        let [u, v] = tangents(fit.normal);
        let cost = |a: f64, b: f64| {
            let normal = leant(fit.normal, [u, v], [a, b]);
            self.residual(moments, normal) + bias(expected, normal)
        };
        let h = PARAMETERS.hessian_step;
        let middle = cost(0.0, 0.0);
        let uu = (cost(h, 0.0) + cost(-h, 0.0) - 2.0 * middle) / (h * h);
        let vv = (cost(0.0, h) + cost(0.0, -h) - 2.0 * middle) / (h * h);
        let uv = (cost(h, h) - cost(h, -h) - cost(-h, h) + cost(-h, -h)) / (4.0 * h * h);
        // The eigenvalues of the bend, which at a border of what is allowed need not be positive.
        let (half, rest) = (
            (uu + vv) / 2.0,
            (((uu - vv) / 2.0).powi(2) + uv * uv).sqrt(),
        );
        let inverse: f64 = [half + rest, half - rest]
            .into_iter()
            .map(|bend| 1.0 / bend.max(PARAMETERS.least_curvature))
            .sum();
        (2.0 * fit.residual / freedom * inverse).sqrt()
    }
}

fn sum(body: &[f64; WAVES], albedo: f64, gloss: &[f64; WAVES]) -> [f64; WAVES] {
    std::array::from_fn(|i| albedo * body[i] + gloss[i])
}

/// Puts one of less cost in its place, and the last one out.
fn insert(best: &mut [(f64, [f64; 3]); PARAMETERS.refined], one: (f64, [f64; 3])) {
    best[PARAMETERS.refined - 1] = one;
    best.sort_by(|a, b| a.0.total_cmp(&b.0));
}

fn bias(expected: Option<Expected>, normal: [f64; 3]) -> f64 {
    expected.map_or(0.0, |expected| {
        expected.weight * (1.0 - dot(expected.normal, normal))
    })
}

/// The best normals of all pixels: near those of other fits, or anywhere.
pub(crate) fn search_all(
    room: &Room,
    moments: &[Moments],
    expected: Option<&[Expected]>,
    near: Option<&[PixelFit]>,
) -> Vec<PixelFit> {
    let search = Search::new(room);
    moments
        .par_iter()
        .enumerate()
        .map(|(pixel, moments)| {
            let expected = expected.map(|all| all[pixel]);
            if moments.is_dark() {
                return PixelFit {
                    normal: expected.map_or([0.0, 0.0, 1.0], |expected| expected.normal),
                    albedo: [0.0; 3],
                    residual: 1.0,
                };
            }
            match near {
                Some(fits) => search.near(moments, expected, fits[pixel].normal),
                None => search.anywhere(moments, expected),
            }
        })
        .collect()
}

/// What is left of the curves, with what normals are off those that are expected, the mean over the pixels.
pub(crate) fn cost(fits: &[PixelFit], expected: Option<&[Expected]>) -> f64 {
    let sum: f64 = fits
        .iter()
        .enumerate()
        .map(|(pixel, fit)| {
            let off = expected.map_or(0.0, |all| {
                let expected = all[pixel];
                expected.weight * (1.0 - dot(expected.normal, fit.normal))
            });
            fit.residual.min(1.0) + off
        })
        .sum();
    sum / fits.len().max(1) as f64
}
