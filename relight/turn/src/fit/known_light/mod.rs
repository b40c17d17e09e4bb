//! Normals and albedo of a whole turn in a light that is known: photometric stereo.

use rayon::prelude::*;
use relight_core::light::ShLight;
use relit_data::statistics::{median, quantile};

use crate::fit::confidence::{
    FREEDOM, FittedPixels, NormalUncertainty, common_error, normal_uncertainties, shared_albedo,
};
use crate::fit::curve_statistics::{CurveStatistics, all_statistics};
use crate::fit::residuals::robust_weights;
use crate::fit::search::{PixelFit, Search, search_all};
use crate::fit::solution::{EstimatedGloss, TurnSolution};
use crate::model::frame::{Elevation, TableFrame};
use crate::model::lighting::{HEAD_ON, MIRROR, TableLight};
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;

/// Number of pixels on which the gloss is fitted. By hand.
const PIXELS: usize = 1000;
/// Of these, every so manieth tells which lobe is about right. By hand.
const ROUGHLY: usize = 4;
/// How strongly gloss reflects, over a smooth dielectric. By hand: up to 16, because light by a dark grey ball is in small
/// units.
const STRENGTHS: [f64; 8] = [0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0];
/// How much the lobe blurs the light: the deviation of a Gaussian, radians. By hand.
const BLURS: [f64; 5] = [0.05, 0.2, 0.35, 0.55, 0.8];
/// How often the best lobe is improved, each time by half the steps between those. By hand.
const REFINED: i32 = 2;
/// Distance between blurs that are tried around the best, radians. By hand.
const BLUR_STEP: f64 = 0.15;
/// Largest smoothness of gloss: sharper lobes look alike in a light of order 6. By hand.
const MAX_SMOOTHNESS: f64 = 200.0;
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
/// Gloss is fitted on some of the pixels, then every pixel by itself. Then parts of the turn with a large residual, shadows
/// and highlights, count less for that pixel, and it is fitted again.
pub fn solve_in_light(
    curves: &TurnCurves,
    light: &ShLight,
    elevation: Elevation,
    material: MaterialKind,
) -> TurnSolution {
    let frame = TableFrame::new(elevation);
    let finish = Finish {
        frame,
        light: TableLight::from_light(&light.rotated(&frame.rotation())),
        material,
    };
    let statistics = all_statistics(curves);
    let lobe = finish.best_lobe(&statistics);
    let model = finish.model(lobe);
    let conditioning = Conditioning::from_curves(curves).in_given(&finish.model(Lobe::SMOOTH));
    let mut solver = Solver {
        curves,
        fits: search_all(&model, &statistics, None),
        model,
        statistics,
    };
    for _ in 0..ROBUST_ROUNDS {
        solver.refine();
    }
    solver.shrink_albedo();
    let common = common_error(elevation, conditioning.verdict.is_fit());
    let normal_uncertainties = solver.normal_uncertainties();
    TurnSolution {
        albedo: shared_albedo(curves, &solver.fits, &normal_uncertainties),
        expected_errors: normal_uncertainties
            .iter()
            .map(|own| own.with(common))
            .collect(),
        fits: solver.fits,
        model: solver.model,
        elevation,
        measured: Some(light.clone()),
        conditioning,
        gloss: finish.gloss(lobe),
    }
}

/// An object of a material in a known light, whose lobe is to be found.
#[derive(Debug, Clone, Copy)]
struct Finish {
    frame: TableFrame,
    light: TableLight,
    material: MaterialKind,
}

/// The light that a mirror would show, as gloss or metal shows it.
#[derive(Debug, Clone, Copy)]
struct Lobe {
    strength: f64,
    blur: f64,
}

impl Lobe {
    /// That of a mirror.
    const SMOOTH: Self = Self {
        strength: 1.0,
        blur: 0.0,
    };

    /// How much it shows of band l.
    fn attenuation(self, l: usize) -> f64 {
        self.strength * (-0.5 * (l * (l + 1)) as f64 * self.blur * self.blur).exp()
    }
}

impl Finish {
    fn model(&self, lobe: Lobe) -> ShadingModel {
        let white = match self.material {
            MaterialKind::Diffuse => 1.0,
            MaterialKind::Metal => MIRROR,
        };
        ShadingModel {
            frame: self.frame,
            diffuse: self.light.irradiance(),
            gloss: self.light.scaled(|l, _| white * lobe.attenuation(l)),
            material: self.material,
        }
    }

    /// The lobe with which pixels of all the object are fitted best. Of an even light metal shows its albedo's part, whatever its lobe
    /// is.
    fn best_lobe(&self, statistics: &[CurveStatistics]) -> Lobe {
        let every = statistics.len().div_ceil(PIXELS).max(1);
        let some: Vec<CurveStatistics> = statistics.iter().step_by(every).copied().collect();
        let strengths = match self.material {
            MaterialKind::Diffuse => &STRENGTHS[..],
            MaterialKind::Metal => &[1.0],
        };
        let tried = strengths.iter();
        let tried = tried.flat_map(|&strength| BLURS.map(|blur| Lobe { strength, blur }));
        let mut best = (f64::INFINITY, Lobe::SMOOTH);
        let few: Vec<CurveStatistics> = some.iter().step_by(ROUGHLY).copied().collect();
        self.try_all(tried, &few, &mut best);
        for round in 1..=REFINED {
            let (part, around) = (0.5_f64.powi(round), best.1);
            best.0 = f64::INFINITY;
            let steps = [-part, 0.0, part];
            let stronger = if strengths.len() > 1 {
                &steps[..]
            } else {
                &[0.0]
            };
            let tried = stronger.iter().flat_map(|more| {
                steps.map(|further| Lobe {
                    strength: around.strength * more.exp2(),
                    blur: (around.blur + further * BLUR_STEP).max(0.0),
                })
            });
            self.try_all(tried, &some, &mut best);
        }
        best.1
    }

    fn try_all(
        &self,
        lobes: impl Iterator<Item = Lobe>,
        statistics: &[CurveStatistics],
        best: &mut (f64, Lobe),
    ) {
        for lobe in lobes {
            let cost = Search::new(&self.model(lobe)).cost(statistics);
            if cost < best.0 {
                *best = (cost, lobe);
            }
        }
    }

    /// The gloss of such a lobe as the render layers take it.
    fn gloss(&self, lobe: Lobe) -> Option<EstimatedGloss> {
        let part = match self.material {
            MaterialKind::Diffuse => HEAD_ON * lobe.strength / MIRROR,
            MaterialKind::Metal => 1.0,
        };
        // A half vector is off by half of what the light is.
        let smoothness = 4.0 / lobe.blur.powi(2);
        (lobe.strength > 0.0).then(|| EstimatedGloss::new(part, smoothness.min(MAX_SMOOTHNESS)))
    }
}

/// All pixels under one light.
struct Solver<'a> {
    curves: &'a TurnCurves,
    model: ShadingModel,
    statistics: Vec<CurveStatistics>,
    fits: Vec<PixelFit>,
}

impl Solver<'_> {
    /// Weights parts of the turn by their residuals, and fits every pixel again.
    fn refine(&mut self) {
        let (curves, model) = (self.curves, &self.model);
        self.statistics = (0..curves.pixels())
            .into_par_iter()
            .map(|pixel| {
                let robust_weights = robust_weights(curves, pixel, &self.fits[pixel], model);
                CurveStatistics::new(curves, pixel, Some(&robust_weights))
            })
            .collect();
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

    /// The expected error of each pixel's normal alone.
    fn normal_uncertainties(&self) -> Vec<NormalUncertainty> {
        normal_uncertainties(FittedPixels {
            curves: self.curves,
            statistics: &self.statistics,
            model: &self.model,
            fits: &self.fits,
        })
    }
}

#[cfg(test)]
mod tests;
