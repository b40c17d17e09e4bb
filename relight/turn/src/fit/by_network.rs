//! Normals, albedo and light of a whole turn. The network of turns answers normals and albedo. A light that is known moves the normals
//! to where the curves fit better; one that is not is found by one linear fit.

use std::f64::consts::FRAC_PI_2;

use relight_core::image::{Linear, Rgb};
use relight_core::light::ShLight;
use relit_data::statistics::median;

use crate::error::TurnError;
use crate::fit::curve_statistics::{CurveStatistics, all_statistics};
use crate::fit::environment::fit_model;
use crate::fit::known_light::refined;
use crate::fit::photo_albedo::mean_albedo;
use crate::fit::solution::TurnSolution;
use crate::model::directions::unit;
use crate::model::frame::{Elevation, TableFrame};
use crate::model::material::MaterialKind;
use crate::model::shading::ShadingModel;
use crate::network::predict::TurnPrediction;
use crate::observe::conditioning::Conditioning;
use crate::observe::curves::TurnCurves;

/// By what the network's expected errors are multiplied, so that four fifths of the pixels that are expected within 10 degrees
/// are. Measured (docs/results/turns.md).
const CALIBRATION: f64 = 1.14;

/// The network's answer for a turn, with the light: a `known` one, in the viewer's frame at the table's angle 0 (bands up to 6
/// count), or the one that fits. The albedo is the mean of its answer and of what the network of photographs has `seen`; that of
/// metal in known light follows the curves.
///
/// # Errors
/// If the exposure was wrong, or no light fits the curves.
pub(crate) fn solve_by_network(
    curves: &TurnCurves,
    found: &TurnPrediction,
    seen: &Rgb<Linear>,
    known: Option<&ShLight>,
    (elevation, material): (Elevation, MaterialKind),
) -> Result<TurnSolution, TurnError> {
    let conditioning = Conditioning::from_curves(curves);
    if let Some(advice) = conditioning.exposure_advice {
        return Err(TurnError::Refused(advice.to_owned()));
    }
    let mut normals: Vec<[f64; 3]> = curves.pixels_of(found.normals.planes()).map(unit).collect();
    let mut albedo = mean_albedo(curves, &found.albedo, seen);
    let statistics = all_statistics(curves);
    let frame = TableFrame::new(elevation);
    // In known light, too: it makes some objects worse, such as a glossy one.
    let expected_errors: Vec<f64> = curves
        .pixels_of(&found.expected_errors)
        .map(|[degrees]| (CALIBRATION * degrees).to_radians().min(FRAC_PI_2))
        .collect();
    let (model, factors) = match known {
        Some(light) => {
            let model = ShadingModel::in_light(light, frame, material);
            normals = refined(curves, &statistics, &model, &normals, &expected_errors);
            let fitted: Vec<[f64; 3]> = (statistics.iter().zip(&normals))
                .map(|(statistics, &normal)| statistics.albedo(&model.harmonics(normal)))
                .collect();
            if material == MaterialKind::Metal {
                // The networks know little of metal.
                albedo = fitted;
                (model, [1.0; 3])
            } else {
                (model, units(&fitted, &albedo))
            }
        }
        None => {
            let all: Vec<&CurveStatistics> = statistics.iter().collect();
            let model = fit_model(&all, &normals, &albedo, &frame, material);
            normalised(model.ok_or(TurnError::NoLight)?, &normals)
        }
    };
    for albedo in &mut albedo {
        *albedo = [0, 1, 2].map(|c| albedo[c] * factors[c]);
    }
    let residuals = normals.iter().zip(&statistics);
    let residuals =
        residuals.map(|(&normal, statistics)| statistics.residual(&model.harmonics(normal)));
    let mut solution = TurnSolution {
        residual: median(residuals).unwrap_or(0.0),
        normals,
        albedo,
        expected_errors,
        model,
        elevation,
        measured: known.cloned(),
        conditioning,
    };
    solution.conditioning = conditioning.expecting(solution.expected_error_deg(), material);
    Ok(solution)
}

/// By what each channel of an albedo is multiplied to be in the light's units: the median of what the curves say.
fn units(fitted: &[[f64; 3]], albedo: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|c| {
        let ratios = fitted.iter().zip(albedo);
        let ratios = ratios.map(|(fitted, albedo)| fitted[c] / albedo[c].max(1e-12));
        median(ratios).unwrap_or(1.0)
    })
}

/// The shading model in whose light the mean shading of each channel is 1, and by what its light was divided.
fn normalised(mut model: ShadingModel, normals: &[[f64; 3]]) -> (ShadingModel, [f64; 3]) {
    let mut sums = [0.0; 3];
    for &normal in normals {
        let harmonics = model.harmonics(normal);
        for (sum, harmonics) in sums.iter_mut().zip(harmonics) {
            *sum += harmonics[0];
        }
    }
    let factors = sums.map(|sum| {
        let mean = sum / normals.len() as f64;
        if mean > 1e-12 { mean } else { 1.0 }
    });
    model.shown = model.shown.scaled(|_, channel| 1.0 / factors[channel]);
    (model, factors)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TurnVerdict;
    use crate::observe::curves::CurveBuilder;
    use crate::tests::{
        LEAN_DEG, SIDE, TAKE, Take, albedo_off, ball, elevation, environment, even_environment,
        film, knowing, leaning, metal_ball, off, solve,
    };
    use relight_core::image::Extent;
    use relight_core::light::{Direction, Rotation};

    #[test]
    fn the_light_that_goes_with_a_network_s_answer_is_found_up_to_its_colour() {
        let (surface, light) = (ball(), environment());
        let curves = film(&surface, &light, TAKE);
        let prediction = knowing(&surface, 10.0);
        let material = MaterialKind::Diffuse;
        let seen = surface.albedo();
        let found =
            solve_by_network(&curves, &prediction, seen, None, (elevation(), material)).unwrap();
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
            let found = solve_by_network(&curves, &prediction, seen, None, (elevation(), material))
                .unwrap();
            assert_eq!(found.material(), material);
            let is_metal = material == MaterialKind::Metal;
            assert_eq!(found.verdict() == TurnVerdict::Uncertain, is_metal);
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
            let (seen, facts) = (ball().albedo().clone(), (elevation(), material));
            let found = solve_by_network(&curves, &prediction, &seen, None, facts);
            let refused = found.unwrap_err().to_string();
            assert!(refused.contains(said), "{refused}");
        }
    }

    #[test]
    fn a_known_light_moves_normals_to_where_the_curves_fit() {
        let (surface, light) = (ball(), environment());
        let half = Take { part: 0.67, ..TAKE };
        let bright = Take { gain: 4.0, ..TAKE };
        for take in [TAKE, half, bright] {
            let curves = film(&surface, &light, take);
            let found = solve(&curves, &light);
            let error = off(&surface, &found.normals(&curves));
            assert!(error < 2.5, "{take:?} {error}");
        }
    }

    #[test]
    fn in_a_known_light_albedo_has_the_light_s_units() {
        let (surface, light) = (ball(), environment());
        for gain in [0.3, 1.0] {
            let curves = film(&surface, &light, Take { gain, ..TAKE });
            let albedo = solve(&curves, &light).albedo(&curves);
            let off = albedo_off(&surface, &albedo, gain as f32);
            assert!(off < 0.1, "{off}");
        }
    }

    #[test]
    fn a_known_light_moves_normals_of_metal() {
        let (surface, light, curves) = metal_ball();
        let (seen, facts) = (surface.albedo(), (elevation(), MaterialKind::Metal));
        let found = solve_by_network(&curves, &leaning(), seen, Some(&light), facts).unwrap();
        let error = off(&surface, &found.normals(&curves));
        assert!(error < LEAN_DEG / 2.0, "{error}");
        let lit = found.surface(&curves).unwrap();
        assert_eq!(lit.albedo().planes().pixel(SIDE / 2, SIDE / 2), [0.0; 3]);
    }

    #[test]
    fn in_an_even_known_light_the_network_s_normals_stay() {
        let (surface, even) = (ball(), even_environment());
        let curves = film(&surface, &environment(), TAKE);
        let found = solve(&curves, &even);
        let error = off(&surface, &found.normals(&curves));
        assert!((error - LEAN_DEG).abs() < LEAN_DEG / 2.0, "{error}");
    }

    #[test]
    fn where_the_turn_starts_changes_nothing_but_the_light_s_angle() {
        let (surface, light) = (ball(), environment());
        for first_deg in [-130.0_f64, 77.0] {
            let curves = film(&surface, &light, Take { first_deg, ..TAKE });
            // At the angle 0 the light is as it was when the table still had `first_deg` to go.
            let [x, y, z] = TableFrame::new(elevation()).axis();
            let axis = Direction::new(x, y, z).unwrap();
            let turned = light.rotated(&Rotation::about(axis, first_deg.to_radians()));
            let found = solve(&curves, &turned);
            assert!(off(&surface, &found.normals(&curves)) < 2.5);
        }
    }
}
