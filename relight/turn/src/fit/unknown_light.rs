//! Normals, albedo and light of a whole turn in a light that is not known: the network of turns answers normals and albedo,
//! and one linear fit finds the light that goes with them.

use std::f64::consts::FRAC_PI_2;

use relight_core::image::{Linear, Rgb};

use crate::error::TurnError;
use crate::fit::curve_statistics::{CurveStatistics, HarmonicProducts, all_statistics};
use crate::fit::environment::fit_model;
use crate::fit::photo_albedo::mean_albedo;
use crate::fit::search::PixelFit;
use crate::fit::solution::{EstimatedGloss, TurnSolution};
use crate::model::directions::unit;
use crate::model::frame::{Elevation, TableFrame};
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::network::predict::TurnPrediction;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;

/// Mean error of normals over what the network expects. Measured: (docs/results/turns.md).
const CALIBRATION: f64 = 1.14;
/// Smoothness (exponent of the lobe) of metal in unknown light, which no turn determines. By convention.
const METAL_SMOOTHNESS: f64 = 60.0;

/// The network's answer for a turn, with the fitted light. The albedo is the mean of its answer and
/// of what the network of photographs has `seen`.
///
/// # Errors
/// If the exposure was wrong, or no light fits the curves.
pub(crate) fn solve_by_network(
    curves: &TurnCurves,
    found: &TurnPrediction,
    seen: &Rgb<Linear>,
    elevation: Elevation,
    material: MaterialKind,
) -> Result<TurnSolution, TurnError> {
    let conditioning = Conditioning::from_curves(curves);
    if let Some(advice) = conditioning.verdict.exposure_advice() {
        return Err(TurnError::Refused(advice.to_owned()));
    }
    let normals: Vec<[f64; 3]> = curves.pixels_of(found.normals.planes()).map(unit).collect();
    let mut albedo = mean_albedo(curves, &found.albedo, seen);
    let statistics = all_statistics(curves);
    let frame = TableFrame::new(elevation);
    let all: Vec<&CurveStatistics> = statistics.iter().collect();
    let model = fit_model(&all, &normals, &albedo, &frame, material);
    let (model, factors) = normalised(model.ok_or(TurnError::NoLight)?, &normals);
    for albedo in &mut albedo {
        *albedo = [0, 1, 2].map(|c| albedo[c] * factors[c]);
    }
    let fits = normals.iter().zip(&statistics);
    let fits: Vec<PixelFit> = fits
        .map(|(&normal, statistics)| fit_of(&model, normal, statistics))
        .collect();
    let expected_errors: Vec<f64> = curves
        .pixels_of(&found.expected_errors)
        .map(|[degrees]| (CALIBRATION * degrees).to_radians().min(FRAC_PI_2))
        .collect();
    let mut solution = TurnSolution {
        fits,
        albedo,
        expected_errors,
        model,
        elevation,
        measured: None,
        conditioning,
        // What metal shows is all that is known of the light: it may be blurred or not.
        gloss: (material == MaterialKind::Metal)
            .then(|| EstimatedGloss::new(1.0, METAL_SMOOTHNESS)),
    };
    solution.conditioning = conditioning.by_network(solution.expected_error_deg());
    Ok(solution)
}

/// The shading model in whose light the mean shading of each channel is 1, and by what its light was divided.
fn normalised(mut model: ShadingModel, normals: &[[f64; 3]]) -> (ShadingModel, [f64; 3]) {
    let mut sums = [0.0; 3];
    for &normal in normals {
        let harmonics = model.harmonics(normal);
        for (sum, harmonics) in sums.iter_mut().zip(harmonics.base) {
            *sum += harmonics[0];
        }
    }
    let factors = sums.map(|sum| {
        let mean = sum / normals.len() as f64;
        if mean > 1e-12 { mean } else { 1.0 }
    });
    for light in [&mut model.diffuse, &mut model.gloss] {
        *light = light.scaled(|_, channel| 1.0 / factors[channel]);
    }
    (model, factors)
}

/// A pixel of this normal, with the albedo that fits its curve best.
fn fit_of(model: &ShadingModel, normal: [f64; 3], statistics: &CurveStatistics) -> PixelFit {
    if statistics.is_dark() {
        return PixelFit {
            normal,
            ..PixelFit::DARK
        };
    }
    let harmonics = model.harmonics(normal);
    PixelFit {
        normal,
        albedo: statistics.albedo(&harmonics),
        residual: statistics.residual(&harmonics, &HarmonicProducts::from_harmonics(&harmonics)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TurnVerdict;
    use crate::observe::curves::CurveBuilder;
    use crate::tests::{TAKE, ball, elevation, environment, film, knowing, metal_ball, off};
    use relight_core::image::Extent;

    #[test]
    fn the_light_that_goes_with_a_network_s_answer_is_found_up_to_its_colour() {
        let (surface, light) = (ball(), environment());
        let curves = film(&surface, &light, TAKE);
        let prediction = knowing(&surface, 10.0);
        let material = MaterialKind::Diffuse;
        let found = solve_by_network(
            &curves,
            &prediction,
            surface.albedo(),
            elevation(),
            material,
        )
        .unwrap();
        assert!(off(&surface, &found.normals(&curves)) < 0.1);
        assert!((found.expected_error_deg() - 10.0 * CALIBRATION).abs() < 1e-3);
        assert_eq!(found.verdict(), TurnVerdict::Good);
        let coefficients = found.light().unwrap();
        for c in 0..3 {
            let scale = light.coefficients()[0][c] / coefficients.coefficients()[0][c];
            for (a, b) in coefficients.coefficients().iter().zip(light.coefficients()) {
                assert!(
                    (a[c] * scale - b[c]).abs() < 0.02,
                    "{} {}",
                    a[c] * scale,
                    b[c]
                );
            }
        }
        let shading = found.shading(&curves);
        let mean = shading.planes().plane(1).iter().sum::<f32>() / curves.pixels() as f32;
        assert!((mean - 1.0).abs() < 1e-3, "{mean}");
    }

    #[test]
    fn metal_that_was_given_as_such_is_explained() {
        let (surface, _, curves) = metal_ball();
        let prediction = knowing(&surface, 10.0);
        let residual = |material| {
            let seen = surface.albedo();
            let found =
                solve_by_network(&curves, &prediction, seen, elevation(), material).unwrap();
            assert_eq!(found.material(), material);
            found.residual()
        };
        let (metal, diffuse) = (
            residual(MaterialKind::Metal),
            residual(MaterialKind::Diffuse),
        );
        assert!(metal < 0.02 && metal < diffuse, "{metal} {diffuse}");
    }

    #[test]
    fn of_a_dark_turn_and_a_white_one_the_exposure_is_named() {
        let extent = Extent::new(24, 24);
        for (level, said) in [(0.0, "underexposed"), (1.0, "overexposed")] {
            let mut builder = CurveBuilder::new(extent, &[1.0; 576]).unwrap();
            for k in 0..36 {
                let angle = f64::from(k) * 10.0;
                builder.push(angle, extent, [&[level; 576]; 3]).unwrap();
            }
            let curves = builder.finish().unwrap();
            let (prediction, material) = (knowing(&ball(), 10.0), MaterialKind::Diffuse);
            let found =
                solve_by_network(&curves, &prediction, ball().albedo(), elevation(), material);
            let refused = found.unwrap_err().to_string();
            assert!(refused.contains(said), "{refused}");
        }
    }
}
