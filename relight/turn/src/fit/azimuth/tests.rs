use super::*;
use crate::test_turns::{SIDE, TAKE, ball, elevation, environment, film};
use crate::{RotationDirection, TableFrame};

fn frame() -> TableFrame {
    TableFrame::new(elevation())
}

fn evidence(azimuth_deg: f64, uncertainty_deg: f64) -> AzimuthEvidence {
    AzimuthEvidence {
        source: AzimuthSource::Panorama,
        azimuth_deg,
        uncertainty_deg,
    }
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
    let (mean, deviation) = product(&[evidence(20.0, 8.0), evidence(28.0, 8.0)]);
    assert!((mean - 24.0).abs() < 0.1, "{mean}");
    assert!(
        (deviation - 8.0 / 2.0_f64.sqrt()).abs() < 0.1,
        "{deviation}"
    );
    let (mean, deviation) = product(&[evidence(-170.0, 4.0), evidence(130.0, 60.0)]);
    assert!(
        (mean - -170.0).abs() < 1.0 && deviation < 4.1,
        "{mean} {deviation}"
    );
    // Across 180 degrees there is no jump.
    let (mean, _) = product(&[evidence(178.0, 10.0), evidence(-178.0, 10.0)]);
    assert!((mean.abs() - 180.0).abs() < 1e-6, "{mean}");
}

#[test]
fn a_concentration_gives_back_its_deviation() {
    for degrees in [2.0_f64, 10.0, 30.0, 60.0, 90.0] {
        let (_, back) = product(&[evidence(0.0, degrees)]);
        assert!((back / degrees - 1.0).abs() < 0.03, "{degrees}: {back}");
    }
}

#[test]
fn a_prior_that_is_turned_about_the_axis_is_turned_back_by_a_light_that_is_known() {
    let (curves, prior) = turned_prior(25.0);
    let given = TableLight::from_viewer(&environment(), &frame());
    let sources = AzimuthSources {
        frame: frame(),
        panorama: None,
        given: Some(&given),
    };
    let (aligned, figures) = sources.align(&curves, &prior).unwrap();
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
    let (mean, _) = product(&[evidence(0.0, 6.0), clear]);
    assert!((0.0..2.0).contains(&mean), "{mean}");
}

#[test]
fn a_prior_without_errors_stays_as_it_is() {
    let (curves, prior) = turned_prior(10.0);
    let sources = AzimuthSources {
        frame: frame(),
        panorama: None,
        given: None,
    };
    let plain = TurnPrior {
        expected_errors: None,
        ..prior
    };
    assert!(sources.align(&curves, &plain).is_none());
    assert_eq!(curves.extent().width, SIDE);
}
