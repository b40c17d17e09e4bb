use crate::test_turns::{
    SIDE, SOLVED, albedo_off, ball, elevation, environment, frame, known, mask, metal_ball, off,
    read,
};
use crate::{CurveBuilder, MaterialKind, TurnError, TurnLabels, TurnOptions, solve_turn};

#[test]
fn a_table_that_turns_the_other_way_is_noticed() {
    let (surface, light) = (ball(), environment());
    let mut builder = CurveBuilder::new(surface.extent(), mask(&surface).plane(0)).unwrap();
    for k in 0..90 {
        let angle = f64::from(k) * 4.0;
        let image = frame(&surface, &light, -angle);
        builder
            .push(angle, surface.extent(), image.planes().planes())
            .unwrap();
    }
    let curves = builder.finish().unwrap();
    let unknown = TurnOptions {
        elevation: elevation(),
        prior: Some(surface.normals().clone().into()),
        ..TurnOptions::default()
    };
    for options in [known(&light), unknown] {
        let wrong = solve_turn(&curves, &options).unwrap().direction().unwrap();
        assert!(wrong.is_doubted(), "{wrong:?}");
        let right = solve_turn(&SOLVED.0.curves, &options).unwrap();
        let right = right.direction().unwrap();
        assert!(!right.is_doubted(), "{right:?}");
    }
}

#[test]
fn metal_is_told_by_its_residual_and_found_in_known_light() {
    let (surface, light, curves) = metal_ball();
    let found = solve_turn(&curves, &known(&light)).unwrap();
    assert_eq!(found.material(), MaterialKind::Metal);
    let [diffuse, metal] = found.materials() else {
        panic!("{:?}", found.materials());
    };
    assert!(
        diffuse.residual > 10.0 * metal.residual,
        "{diffuse:?} {metal:?}"
    );
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
fn metal_is_found_in_unknown_light_with_prior_normals() {
    let (surface, _, curves) = metal_ball();
    let options = TurnOptions {
        elevation: elevation(),
        prior: Some(surface.normals().clone().into()),
        ..TurnOptions::default()
    };
    let found = solve_turn(&curves, &options).unwrap();
    assert_eq!(found.material(), MaterialKind::Metal);
    let off = off(&surface, &found.normals(&curves));
    assert!(off < 1.0, "{off}");
}

#[test]
fn a_material_that_was_given_is_taken_but_doubted_and_metal_has_no_labels() {
    let turn = read(&ball(), &environment());
    let options = TurnOptions {
        material: Some(MaterialKind::Metal),
        ..known(&environment())
    };
    let found = solve_turn(&turn.curves, &options).unwrap();
    assert_eq!(
        (found.material(), found.materials().len()),
        (MaterialKind::Metal, 2)
    );
    let (_, light, curves) = metal_ball();
    let wrongly = TurnOptions {
        material: Some(MaterialKind::Diffuse),
        ..known(&light)
    };
    let wrong = solve_turn(&curves, &wrongly).unwrap();
    assert_eq!(wrong.material(), MaterialKind::Diffuse);
    assert_eq!(wrong.doubted_material(), Some(MaterialKind::Metal));
    let rightly = TurnOptions {
        material: Some(MaterialKind::Diffuse),
        ..known(&environment())
    };
    let right = solve_turn(&turn.curves, &rightly).unwrap();
    assert_eq!(right.doubted_material(), None);
    assert_eq!(SOLVED.1.doubted_material(), None);
    let labels = TurnLabels {
        turn: &turn,
        solution: &found,
        least_confidence: 0.5,
    };
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("labels");
    assert!(matches!(labels.write(&out), Err(TurnError::NoDiffusePart)));
    assert!(!out.exists());
}
