use relit_data::rig::RotationDirection;

use crate::test_turns::{
    SOLVED, TAKE, ball, environment, even_environment, expecting, film, read, solve, solved,
};
use crate::{ReadTurn, RotationSource, SolvedTurn, TableRotation, TurnVerdict, TurnWarning};

/// The ball's turn in its own light.
fn ball_solved() -> SolvedTurn {
    solved(read(&ball(), &environment()), SOLVED.1.clone())
}

#[test]
fn a_turn_in_its_own_light_has_no_warnings() {
    let solved = ball_solved();
    assert_eq!(solved.warnings(), Vec::new());
    assert!(solved.is_whole());
}

#[test]
fn an_even_given_light_damage_and_missing_angles_are_told_in_order() {
    let good = ball_solved();
    let turn = ReadTurn {
        curves: film(&ball(), &environment(), TAKE),
        has_angles: false,
        damage: vec!["sample 3 is damaged".to_owned()],
        ..good.turn
    };
    let solved = SolvedTurn {
        solution: solve(&turn.curves, &even_environment()),
        turn,
        ..good
    };
    let expected = [
        TurnWarning::NoAngles,
        TurnWarning::Damage("sample 3 is damaged".to_owned()),
        TurnWarning::Unfit(TurnVerdict::TooEven),
        TurnWarning::GivenLightIsEven,
    ];
    assert_eq!(solved.warnings(), expected);
    assert!(!solved.is_whole());
}

#[test]
fn a_rotation_is_told_where_nobody_said_it_and_it_is_not_the_usual_one() {
    let mut solved = ball_solved();
    let (usual, other) = (RotationDirection::default(), RotationDirection::Clockwise);
    let taken = TurnWarning::TakenRotation { direction: other };
    let assumed = TurnWarning::AssumedRotation { direction: usual };
    for (direction, source, expected) in [
        (usual, RotationSource::Assumed, Some(assumed)),
        (usual, RotationSource::Network, None),
        (other, RotationSource::Network, Some(taken)),
        (other, RotationSource::Rig, None),
        (other, RotationSource::Given, None),
    ] {
        solved.turn.rotation = TableRotation { direction, source };
        assert_eq!(solved.warnings(), Vec::from_iter(expected));
    }
}

#[test]
fn a_network_that_is_surer_of_the_other_direction_says_so() {
    let solved = SolvedTurn {
        network: expecting(20.0, 10.0),
        ..ball_solved()
    };
    let warnings = solved.warnings();
    assert!(
        matches!(warnings[..], [TurnWarning::SurerInOtherDirection { .. }]),
        "{warnings:?}"
    );
}
