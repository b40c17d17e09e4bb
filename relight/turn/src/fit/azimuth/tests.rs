use super::*;
use crate::test_turns::{TAKE, ball, elevation, environment, film};
use crate::{RotationDirection, TableFrame};
use relight_core::light::{Order, ShLight};

fn frame() -> TableFrame {
    TableFrame::new(elevation())
}

/// A turn of the ball, and its true normals turned about the table's axis as a prior.
fn turned_prior(degrees: f64) -> (TurnCurves, TurnPrior) {
    let ball = ball();
    let curves = film(&ball, &environment(), TAKE);
    let normals = turned(&curves, ball.normals(), &frame(), degrees);
    let prior = TurnPrior {
        expected_errors: Some(curves.map(|_| [10.0])),
        ..TurnPrior::from(normals)
    };
    (curves, prior)
}

#[test]
fn two_sources_of_one_kind_are_surer_than_one_and_a_sure_one_outweighs_a_vague_one() {
    let (mean, deviation) = product([(20.0, 8.0), (28.0, 8.0)]);
    assert!((mean - 24.0).abs() < 0.1, "{mean}");
    assert!(
        (deviation - 8.0 / 2.0_f64.sqrt()).abs() < 0.1,
        "{deviation}"
    );
    let (mean, deviation) = product([(-170.0, 4.0), (130.0, 60.0)]);
    assert!(
        (mean - -170.0).abs() < 1.0 && deviation < 4.1,
        "{mean} {deviation}"
    );
    // Across 180 degrees there is no jump.
    let (mean, _) = product([(178.0, 10.0), (-178.0, 10.0)]);
    assert!((mean.abs() - 180.0).abs() < 1e-6, "{mean}");
}

#[test]
fn sources_that_contradict_each_other_are_not_as_sure_as_those_that_agree() {
    let (_, agreed) = product([(0.0, 3.0), (2.0, 3.0)]);
    let (mean, contradicted) = product([(-100.0, 3.0), (0.0, 3.0)]);
    assert!((mean + 50.0).abs() < 1e-6 && agreed < 2.2);
    assert!(contradicted > 45.0, "{contradicted}");
}

#[test]
fn a_light_that_is_even_or_black_says_nothing_of_a_bright_side() {
    let uncertainty = |light: ShLight| of_given(&TableLight::from_viewer(&light, &frame()));
    assert!(uncertainty(ShLight::dark(Order::TWO)) >= 90.0);
    assert!(uncertainty(ShLight::even(Order::TWO, [1.0; 3])) > 80.0);
    assert!(uncertainty(environment()) < 10.0);
}

#[test]
fn a_concentration_gives_back_its_deviation() {
    for degrees in [2.0_f64, 10.0, 30.0, 60.0, 90.0] {
        let (_, back) = product([(0.0, degrees)]);
        assert!((back / degrees - 1.0).abs() < 0.03, "{degrees}: {back}");
    }
}

#[test]
fn a_prior_that_is_turned_about_the_axis_is_turned_back_by_a_light_that_is_known() {
    let (curves, prior) = turned_prior(25.0);
    let prior = TurnPrior {
        expected_errors: None,
        ..prior
    };
    let given = TableLight::from_viewer(&environment(), &frame());
    let sources = AzimuthSources {
        given: Some(&given),
        ..alone()
    };
    let (aligned, figures) = sources.align(&curves, Some(&prior));
    let (aligned, figures) = (aligned.unwrap(), figures.unwrap());
    assert!((-26.0..-15.0).contains(&figures.turned_deg), "{figures:?}");
    assert!(figures.uncertainty_deg < 4.0, "{figures:?}");
    let error = |normals: &Normals<YUp>| {
        let (found, right) = (
            normals_of(&curves, normals),
            normals_of(&curves, ball().normals()),
        );
        let angles = found.iter().zip(&right).map(|(a, b)| {
            let cosine: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
            cosine.clamp(-1.0, 1.0).acos().to_degrees()
        });
        angles.sum::<f64>() / found.len() as f64
    };
    assert!(error(&prior.normals) > 15.0);
    assert!(error(&aligned.normals) < 0.5 * error(&prior.normals));
}

#[test]
fn the_outline_says_by_how_much_normals_are_turned() {
    for degrees in [-30.0, 0.0, 20.0] {
        let (curves, prior) = turned_prior(degrees);
        let normals = normals_of(&curves, &prior.normals);
        let by = turn_of_outline(&curves, &normals, &frame()).unwrap();
        assert!((by + degrees).abs() < 10.0, "{degrees}: {by}");
    }
}

#[test]
fn a_strip_without_a_bright_side_says_nothing() {
    let strip = |bright_part| StripFigures {
        direction: RotationDirection::CounterClockwise,
        field_deg: 26.0,
        correlation: 0.9,
        bright_azimuth_deg: 40.0,
        bright_part,
    };
    assert_eq!(of_panorama(&strip(0.3)), None);
    // And one that has it says little beside a network.
    let clear = of_panorama(&strip(0.7)).unwrap();
    let (mean, _) = product([(0.0, 6.0), stated(&clear)]);
    assert!((0.0..2.0).contains(&mean), "{mean}");
}

/// Nothing but the prior.
fn alone() -> AzimuthSources<'static> {
    AzimuthSources {
        frame: frame(),
        panorama: None,
        given: None,
    }
}

#[test]
fn normals_that_do_not_know_their_errors_are_turned_to_their_outline() {
    let (curves, prior) = turned_prior(25.0);
    let plain = TurnPrior {
        expected_errors: None,
        ..prior.clone()
    };
    let turned = |prior: &TurnPrior| alone().align(&curves, Some(prior)).1.unwrap();
    let (sure, unsure) = (turned(&prior), turned(&plain));
    assert!(sure.turned_deg.abs() < 3.0, "{sure:?}");
    assert!((-24.0..-10.0).contains(&unsure.turned_deg), "{unsure:?}");
    assert!(unsure.uncertainty_deg > 2.0 * sure.uncertainty_deg);
}

#[test]
fn what_is_off_in_the_light_of_the_normals_is_not_made_smaller_by_their_outline() {
    let shape = |light_deviation_deg| TurnedShape {
        azimuth_deg: 40.0,
        normals_deviation_deg: 12.0,
        light_deviation_deg,
        by_outline_deg: Some(0.0),
    };
    let uncertainty = |shape: TurnedShape| shape.light(product(shape.turns())).1;
    assert!((uncertainty(shape(1.0)) - 8.5).abs() < 0.3);
    assert!(uncertainty(shape(30.0)) > 30.0);
}

#[test]
fn a_light_that_was_given_is_told_without_a_prior_too() {
    let (curves, _) = turned_prior(0.0);
    assert!(alone().align(&curves, None).1.is_none());
    let given = TableLight::from_viewer(&environment(), &frame());
    let sources = AzimuthSources {
        given: Some(&given),
        ..alone()
    };
    let (prior, figures) = sources.align(&curves, None);
    let figures = figures.unwrap();
    assert!(prior.is_none() && figures.turned_deg == 0.0);
    assert!((figures.azimuth_deg - given.bright_azimuth_deg()).abs() < 1e-9);
}
