use proptest::prelude::*;
use relight_core::image::{Extent, Planes};
use relight_core::light::{Direction, Normals, Order, Rotation, ShLight, YUp};
use relight_core::render::Surface;

use crate::model::gloss::GlossLight;
use crate::model::shading::ShadingModel;
use crate::test_turns::{
    ELEVATION, SIDE, SOLVED, TAKE, Take, albedo_off, ball, elevation, environment, film, film_in,
    known, off,
};
use crate::{
    CurveBuilder, LightVerdict, MaterialKind, TableFrame, TableLight, TurnError, TurnMaps,
    TurnOptions, TurnPrior, solve_turn,
};

#[test]
fn a_lambertian_ball_in_known_light_is_found_as_it_is() {
    let (turn, found) = &*SOLVED;
    let (surface, curves) = (ball(), &turn.curves);
    assert!(off(&surface, &found.normals(curves)) < 0.3);
    assert!(albedo_off(&surface, &found.albedo(curves), 1.0) < 0.01);
    assert!(found.residual() < 1e-4, "{}", found.residual());
    assert!(found.expected_error_deg() < 15.0);
    let confidence = found.confidence(curves);
    assert!(confidence.plane(0).iter().copied().fold(0.0, f32::max) > 0.6);
}

#[test]
fn with_its_own_normals_as_the_prior_unknown_light_is_found_up_to_its_colour() {
    let (surface, light) = (ball(), environment());
    let curves = film(&surface, &light, TAKE);
    let options = TurnOptions {
        elevation: elevation(),
        prior: Some(surface.normals().clone().into()),
        ..TurnOptions::default()
    };
    let found = solve_turn(&curves, &options).unwrap();
    assert!(off(&surface, &found.normals(&curves)) < 1.0);
    let coefficients = found.light().to_viewer(found.frame()).unwrap();
    for c in 0..3 {
        let scale = light.coefficients()[0][c] / coefficients.coefficients()[0][c];
        for (a, b) in coefficients.coefficients().iter().zip(light.coefficients()) {
            assert!(
                (a[c] * scale - b[c]).abs() < 0.01 * 1.1,
                "{} {}",
                a[c] * scale,
                b[c]
            );
        }
    }
    // Four that lean on the prior, and three that lean on the outline alone.
    assert_eq!(found.initialisations().len(), 7);
    assert_eq!(
        found
            .initialisations()
            .iter()
            .filter(|start| start.taken)
            .count(),
        1
    );
    assert!(!found.is_prior_left_out());
}

/// The ball's normals leaning by this angle about an axis that changes from place to place, degrees.
fn leaning(surface: &Surface, degrees: f32) -> Normals<YUp> {
    let planes = surface.normals().planes();
    let (sin, cos) = degrees.to_radians().sin_cos();
    let normal = |x: usize, y: usize| {
        let [a, b, c] = planes.pixel(x, y);
        // Every other column leans to one side, the rest to the other.
        let sin = if (x + y / 3).is_multiple_of(2) {
            sin
        } else {
            -sin
        };
        [a * cos + c * sin, b, c * cos - a * sin]
    };
    Normals::new(Planes::from_fn(planes.extent(), normal))
}

#[test]
fn normals_that_know_how_far_they_are_off_count_by_it_and_their_errors_are_told() {
    let (surface, light) = (ball(), environment());
    let curves = film(&surface, &light, TAKE);
    let solved = |expected_deg: f32| {
        let prior = TurnPrior {
            normals: leaning(&surface, 10.0),
            expected_errors: Some(Planes::filled(curves.extent(), [expected_deg])),
            albedo: None,
            hypotheses: None,
        };
        let options = TurnOptions {
            elevation: elevation(),
            prior: Some(prior),
            ..TurnOptions::default()
        };
        let found = solve_turn(&curves, &options).unwrap();
        (
            off(&surface, &found.normals(&curves)),
            found.expected_error_deg(),
        )
    };
    // The curves of a ball without noise mend what leans to both sides.
    let (error, expected) = solved(10.0);
    assert!(error < 4.0, "{error}");
    assert!((error..15.0).contains(&expected), "{expected}");
    let (_, less) = solved(5.0);
    let (_, more) = solved(30.0);
    assert!(
        less < expected && expected < more,
        "{less} {expected} {more}"
    );
}

#[test]
fn in_unknown_light_the_outline_alone_gives_a_ball_roughly() {
    let (surface, light) = (ball(), environment());
    let curves = film(&surface, &light, TAKE);
    let options = TurnOptions {
        elevation: elevation(),
        ..TurnOptions::default()
    };
    let found = solve_turn(&curves, &options).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 12.0, "{off}");
    let shading = found.shading(&curves);
    let inside = curves.pixels() as f32;
    let mean = shading.planes().plane(1).iter().sum::<f32>() / inside;
    assert!((mean - 1.0).abs() < 1e-3, "{mean}");
}

#[test]
fn clipped_light_is_left_out() {
    let (surface, light) = (ball(), environment());
    let take = Take { gain: 4.0, ..TAKE };
    let curves = film(&surface, &light, take);
    assert!(
        (0.02..0.5).contains(&curves.clipped()),
        "{}",
        curves.clipped()
    );
    let found = solve_turn(&curves, &known(&light)).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.3, "{off}");
}

#[test]
fn a_turn_of_which_a_third_is_missing_gives_the_same() {
    let (surface, light) = (ball(), environment());
    let curves = film(&surface, &light, Take { part: 0.67, ..TAKE });
    let found = solve_turn(&curves, &known(&light)).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.3, "{off}");
    let albedo_off = albedo_off(&surface, &found.albedo(&curves), 1.0);
    assert!(albedo_off < 0.01, "{albedo_off}");
}

/// A lamp beside even light, to the order of gloss.
fn lamp() -> ShLight {
    let towards = Direction::new(0.8, 0.5, 0.3).unwrap();
    let mut light = ShLight::even(Order::GLOSS, [0.4; 3]);
    let lamp = relight_core::light::basis(Order::GLOSS, towards);
    for (values, lamp) in light.coefficients_mut().iter_mut().zip(lamp) {
        *values = values.map(|value| value + 2.0 * lamp);
    }
    light
}

#[test]
fn a_known_lamp_s_fourth_band_bends_no_normals() {
    let (surface, light) = (ball(), lamp());
    let curves = film(&surface, &light, TAKE);
    let found = solve_turn(&curves, &known(&light)).unwrap();
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.2, "{off}");
}

#[test]
fn gloss_beside_the_diffuse_part_is_found_in_known_light() {
    let (surface, light) = (ball(), environment());
    let table = TableFrame::new(elevation());
    let shown = GlossLight::bands(&light.rotated(&table.rotation()));
    let glossy = ShadingModel {
        frame: table,
        light: TableLight::from_viewer(&light, &table),
        diffuse_beyond: GlossLight::NONE,
        gloss: GlossLight::sum(&shown, &[0.5, 0.4, 0.3]),
        material: MaterialKind::Diffuse,
    };
    let curves = film_in(&glossy, &surface);
    let found = solve_turn(&curves, &known(&light)).unwrap();
    assert_eq!(found.material(), MaterialKind::Diffuse);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 1.0, "{off}");
    let gloss = found.gloss(&curves).unwrap().unwrap();
    assert!(gloss.reflectance > 0.0 && gloss.residual < 0.8, "{gloss:?}");
    let maps = TurnMaps::new(&curves, &found);
    assert!(maps.highlight.pixel(SIDE / 2, SIDE / 2)[0] > 0.002);
}

#[test]
fn a_dark_turn_and_a_white_one_are_wrongly_exposed_and_a_prior_of_another_size_is_refused() {
    let extent = Extent::new(4, 4);
    let of = |level: f32| {
        let mut builder = CurveBuilder::new(extent, &[1.0; 16]).unwrap();
        let grey = [level; 16];
        for k in 0..36 {
            builder
                .push(f64::from(k) * 10.0, extent, [&grey; 3])
                .unwrap();
        }
        builder.finish().unwrap()
    };
    for (level, verdict, says) in [
        (
            0.0,
            LightVerdict::Underexposed,
            "the object is underexposed",
        ),
        (1.0, LightVerdict::Overexposed, "the object is overexposed"),
    ] {
        let curves = of(level);
        let unknown = solve_turn(&curves, &TurnOptions::default()).unwrap_err();
        assert!(matches!(unknown, TurnError::Unfit(found) if found == verdict));
        assert!(unknown.to_string().contains(says), "{unknown}");
        let found = solve_turn(&curves, &known(&environment())).unwrap();
        assert_eq!(found.conditioning().verdict, verdict);
        assert_eq!(found.albedo(&curves).planes().pixel(1, 1), [0.0; 3]);
        assert!(found.confidence(&curves).plane(0)[0] < 0.1);
    }
    let options = TurnOptions {
        prior: Some(Normals::sphere(5).into()),
        ..TurnOptions::default()
    };
    let refused = solve_turn(&of(0.3), &options);
    assert!(matches!(refused, Err(TurnError::PriorSize { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4))]

    #[test]
    fn where_the_turn_starts_changes_nothing_but_the_light_s_angle(first_deg in -400.0_f64..400.0) {
        let (surface, light) = (ball(), environment());
        let curves = film(&surface, &light, Take { first_deg, ..TAKE });
        // At the angle 0 the light is as it was when the table still had `first_deg` to go.
        let (sin, cos) = ELEVATION.to_radians().sin_cos();
        let axis = Direction::new(0.0, cos, sin).unwrap();
        let turned = light.rotated(&Rotation::about(axis, first_deg.to_radians()));
        let found = solve_turn(&curves, &known(&turned)).unwrap();
        prop_assert!(off(&surface, &found.normals(&curves)) < 0.3);
        prop_assert!(albedo_off(&surface, &found.albedo(&curves), 1.0) < 0.01);
    }

    #[test]
    fn brighter_frames_make_a_brighter_albedo_and_the_same_normals(gain in 0.05_f64..1.2) {
        let (surface, light) = (ball(), environment());
        let curves = film(&surface, &light, Take { gain, ..TAKE });
        let found = solve_turn(&curves, &known(&light)).unwrap();
        prop_assert!(off(&surface, &found.normals(&curves)) < 0.3);
        prop_assert!(albedo_off(&surface, &found.albedo(&curves), gain as f32) < 0.01);
    }
}
