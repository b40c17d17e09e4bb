use proptest::prelude::*;
use relight_core::image::Extent;
use relight_core::light::{Direction, Order, Rotation, ShLight};

use crate::model::lighting::TableLight;
use crate::model::shading::ShadingModel;
use crate::observe::curves::CurveBuilder;
use crate::tests::{
    ELEVATION, SIDE, SOLVED, TAKE, Take, albedo_off, ball, elevation, environment, film, film_in,
    metal_ball, off, solve,
};
use crate::{MaterialKind, TableFrame, TurnVerdict, solve_in_light};

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
fn clipped_light_is_left_out() {
    let (surface, light) = (ball(), environment());
    let take = Take { gain: 4.0, ..TAKE };
    let curves = film(&surface, &light, take);
    assert!(
        (0.02..0.5).contains(&curves.clipped()),
        "{}",
        curves.clipped()
    );
    let found = solve(&curves, &light);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.3, "{off}");
}

#[test]
fn a_turn_of_which_a_third_is_missing_gives_the_same() {
    let (surface, light) = (ball(), environment());
    let curves = film(&surface, &light, Take { part: 0.67, ..TAKE });
    let found = solve(&curves, &light);
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
    let found = solve(&curves, &light);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 0.2, "{off}");
}

#[test]
fn gloss_beside_the_diffuse_part_is_found_in_known_light() {
    let (surface, light) = (ball(), environment());
    let table = TableFrame::new(elevation());
    let shown = TableLight::from_light(&light.rotated(&table.rotation()));
    let glossy = ShadingModel {
        frame: table,
        diffuse: shown.irradiance(),
        gloss: shown.scaled(|l, _| [0.5, 0.4, 0.3, 0.0, 0.0, 0.0, 0.0][l]),
        material: MaterialKind::Diffuse,
    };
    let curves = film_in(&glossy, &surface);
    let found = solve(&curves, &light);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 1.0, "{off}");
    let gloss = found.gloss.unwrap();
    assert!(
        gloss.reflectance > 0.0 && (8.0..60.0).contains(&gloss.smoothness),
        "{gloss:?}"
    );
}

#[test]
fn metal_that_was_given_as_such_is_found() {
    let (surface, light, curves) = metal_ball();
    let found = solve_in_light(&curves, &light, elevation(), MaterialKind::Metal);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 1.0, "{off}");
    assert!(albedo_off(&surface, &found.albedo(&curves), 1.0) < 0.05);
    let lit = found.surface(&curves).unwrap();
    assert_eq!(lit.albedo().planes().pixel(SIDE / 2, SIDE / 2), [0.0; 3]);
    let [r, g, _] = lit.gloss().unwrap().reflectance().pixel(SIDE / 2, SIDE / 2);
    let [red, green, _] = surface.albedo().planes().pixel(SIDE / 2, SIDE / 2);
    assert!((r / g - red / green).abs() < 0.1, "{r} {g}");
}

#[test]
fn a_dark_turn_and_a_white_one_are_wrongly_exposed() {
    let extent = Extent::new(4, 4);
    for (level, verdict) in [
        (0.0, TurnVerdict::Underexposed),
        (1.0, TurnVerdict::Overexposed),
    ] {
        let mut builder = CurveBuilder::new(extent, &[1.0; 16]).unwrap();
        let grey = [level; 16];
        for k in 0..36 {
            builder
                .push(f64::from(k) * 10.0, extent, [&grey; 3])
                .unwrap();
        }
        let curves = builder.finish().unwrap();
        let found = solve(&curves, &environment());
        assert_eq!(found.verdict(), verdict);
        assert_eq!(found.albedo(&curves).planes().pixel(1, 1), [0.0; 3]);
        assert!(found.confidence(&curves).plane(0)[0] < 0.1);
    }
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
        let found = solve(&curves, &turned);
        prop_assert!(off(&surface, &found.normals(&curves)) < 0.3);
        prop_assert!(albedo_off(&surface, &found.albedo(&curves), 1.0) < 0.01);
    }

    #[test]
    fn brighter_frames_make_a_brighter_albedo_and_the_same_normals(gain in 0.05_f64..1.2) {
        let (surface, light) = (ball(), environment());
        let curves = film(&surface, &light, Take { gain, ..TAKE });
        let found = solve(&curves, &light);
        prop_assert!(off(&surface, &found.normals(&curves)) < 0.3);
        prop_assert!(albedo_off(&surface, &found.albedo(&curves), gain as f32) < 0.01);
    }
}
