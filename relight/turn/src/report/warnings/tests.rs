use std::f64::consts::PI;

use relight_core::light::{Direction, Rotation};
use relit_data::rig::RotationDirection;

use crate::tests::{SOLVED, ball, elevation, environment, expecting, read, solve, solved};
use crate::{FactSource, ReadTurn, SolvedTurn, TableFrame, TableRotation};

/// The ball's turn in its own light.
fn ball_solved() -> SolvedTurn {
    solved(read(&ball(), &environment()), SOLVED.1.clone())
}

/// Whether each warning names what stands in the same place.
#[track_caller]
fn check(solved: &SolvedTurn, expected: &[&str]) {
    let warnings = solved.warnings();
    assert_eq!(warnings.len(), expected.len(), "{warnings:?}");
    for (warning, part) in warnings.iter().zip(expected) {
        assert!(warning.contains(part), "{part}: {warning}");
    }
}

#[test]
fn a_turn_in_its_own_light_has_no_warnings() {
    let solved = ball_solved();
    check(&solved, &[]);
    assert!(solved.is_whole());
}

#[test]
fn the_light_of_another_turn_damage_and_missing_angles_are_told_in_order() {
    let good = ball_solved();
    let turn = ReadTurn {
        has_angles: false,
        damage: vec!["sample 3 is damaged".to_owned()],
        ..good.turn
    };
    let [x, y, z] = TableFrame::new(elevation()).axis();
    let half = Rotation::about(Direction::new(x, y, z).unwrap(), PI);
    let solved = SolvedTurn {
        solution: solve(&turn.curves, &environment().rotated(&half)),
        turn,
        ..good
    };
    check(&solved, &["angles", "sample 3 is damaged", "light"]);
    assert!(!solved.is_whole());
}

#[test]
fn a_turn_that_the_data_set_calls_broken_is_not_whole() {
    let solved = SolvedTurn {
        broken: Some("the mask does not fit".to_owned()),
        ..ball_solved()
    };
    check(&solved, &["the mask does not fit"]);
    assert!(!solved.is_whole());
}

#[test]
fn a_rotation_is_told_where_nobody_said_it_and_it_is_not_the_usual_one() {
    let mut solved = ball_solved();
    let (usual, other) = (RotationDirection::default(), RotationDirection::Clockwise);
    let taken = "--rotation clockwise";
    let assumed = "--rotation";
    for (direction, source, expected) in [
        (usual, FactSource::Assumed, Some(assumed)),
        (usual, FactSource::Network, None),
        (other, FactSource::Network, Some(taken)),
        (other, FactSource::Rig, None),
        (other, FactSource::Given, None),
    ] {
        solved.turn.rotation = TableRotation { direction, source };
        check(&solved, expected.as_slice());
    }
}

#[test]
fn a_network_that_is_surer_of_the_other_direction_says_so() {
    let solved = SolvedTurn {
        network: expecting(20.0, 10.0),
        ..ball_solved()
    };
    check(&solved, &["--rotation clockwise"]);
}
