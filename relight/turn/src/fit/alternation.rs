//! An unknown light from one initialisation.

use crate::fit::blocks::Blocks;
use crate::fit::curve_statistics::CurveStatistics;
use crate::fit::environment::{fit_lambertian, fit_metal};
use crate::fit::figures::MaterialFigure;
use crate::fit::search::PixelFit;
use crate::fit::setting::{GLOSS_BANDS, Setting};
use crate::fit::smoothing::smoothed_normals;
use crate::fit::unknowns::Unknowns;
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;

/// Parameters of the fit of an unknown light.
pub(crate) struct AlternationParameters {
    /// Rounds that alternate between light and normals. By hand.
    pub(crate) rounds: usize,
    /// Bands of the light that metal shows in the first round; one more every other round. By hand.
    pub(crate) first_bands: usize,
    /// Gauss-Newton steps of the joint optimisation in each of its rounds. By hand.
    pub(crate) joint_steps: usize,
    /// Its rounds: before each, the normals are searched anywhere. By hand.
    pub(crate) joint_rounds: usize,
    /// Smoothing of the normals in the first round, standard deviation in widths of the frame. By hand.
    pub(crate) first_blur: f64,
    /// Factor of that standard deviation from round to round. By hand.
    pub(crate) blur_fall: f64,
    /// Least standard deviation, pixels. By hand.
    pub(crate) least_blur: f64,
    /// Standard deviation below which nothing is smoothed, blocks. Numerical.
    no_blur: f64,
    /// Residual up to which a diffuse object in unknown light has no gloss, over the energy of the variation. By hand:
    /// with gloss, other light and shape fit as well.
    pub(crate) lambertian_residual: f64,
}

pub(crate) const ALTERNATION_PARAMETERS: AlternationParameters = AlternationParameters {
    rounds: 8,
    first_bands: 3,
    joint_steps: 8,
    joint_rounds: 2,
    first_blur: 6.0 / 256.0,
    blur_fall: 0.8,
    least_blur: 0.6,
    no_blur: 0.3,
    lambertian_residual: 0.005,
};

/// An unknown light from one initialisation.
pub(crate) struct Alternation<'a> {
    pub(crate) coarse: &'a Blocks,
    pub(crate) setting: &'a Setting,
    pub(crate) material: MaterialKind,
}

impl Alternation<'_> {
    /// The final residual and shading model: light and normals in alternation, then a joint optimisation. A diffuse
    /// object has no gloss yet.
    pub(crate) fn run(&self, start: Vec<[f64; 3]>) -> Option<(f64, ShadingModel)> {
        let coarse = self.coarse;
        let mut normals = start;
        let mut albedo = self.first_albedo();
        let mut model = None;
        for round in 0..ALTERNATION_PARAMETERS.rounds {
            let found = self.room_of(&normals, &mut albedo, round)?;
            let fits = coarse.fits(&found);
            for (albedo, fit) in albedo.iter_mut().zip(&fits) {
                *albedo = fit.albedo;
            }
            normals = self.smoothed(&fits, round);
            model = Some(found);
        }
        if self.material == MaterialKind::Metal {
            let all = coarse.joint(self.setting.unknowns(self.material));
            return Some(all.found(
                model?,
                ALTERNATION_PARAMETERS.joint_rounds,
                ALTERNATION_PARAMETERS.joint_steps,
            ));
        }
        let diffuse = coarse.joint(Unknowns::Light { bands: 0 });
        Some(diffuse.found(model?, 1, ALTERNATION_PARAMETERS.joint_steps))
    }

    /// The same with gloss.
    pub(crate) fn with_gloss(&self, model: ShadingModel) -> (f64, ShadingModel) {
        let all = self.coarse.joint(self.setting.unknowns(self.material));
        all.found(
            model,
            ALTERNATION_PARAMETERS.joint_rounds,
            ALTERNATION_PARAMETERS.joint_steps,
        )
    }

    /// Whether a shading model without gloss fits the curves.
    pub(crate) fn is_lambertian(&self, model: &ShadingModel) -> bool {
        let fits = self.coarse.fits(model);
        MaterialFigure::new(self.material, &fits).residual
            <= ALTERNATION_PARAMETERS.lambertian_residual
    }

    /// The shading model that fits given normals, in alternation with the albedo.
    pub(crate) fn room_of(
        &self,
        normals: &[[f64; 3]],
        albedo: &mut [[f64; 3]],
        round: usize,
    ) -> Option<ShadingModel> {
        let (statistics, frame) = (&self.coarse.statistics, &self.setting.frame);
        match self.material {
            MaterialKind::Diffuse => fit_lambertian(statistics, normals, albedo, frame),
            MaterialKind::Metal => {
                let bands = (ALTERNATION_PARAMETERS.first_bands + round / 2).min(GLOSS_BANDS);
                fit_metal(statistics, normals, albedo, frame, bands)
            }
        }
    }

    /// As if the shading were even.
    pub(crate) fn first_albedo(&self) -> Vec<[f64; 3]> {
        let curves = &self.coarse.curves;
        (0..curves.pixels())
            .map(|pixel| CurveStatistics::mean(curves, pixel).map(|mean| mean.max(1e-6)))
            .collect()
    }

    pub(crate) fn smoothed(&self, fits: &[PixelFit], round: usize) -> Vec<[f64; 3]> {
        let across = self.coarse.curves.extent().width as f64;
        let deviation = if self.setting.has_shape {
            0.0
        } else {
            let fall = ALTERNATION_PARAMETERS.blur_fall.powi(round as i32);
            (ALTERNATION_PARAMETERS.first_blur * across * fall)
                .max(ALTERNATION_PARAMETERS.least_blur / self.coarse.side as f64)
        };
        if deviation < ALTERNATION_PARAMETERS.no_blur {
            return fits.iter().map(|fit| fit.normal).collect();
        }
        smoothed_normals(&self.coarse.curves, deviation, |pixel| fits[pixel].normal)
    }
}
