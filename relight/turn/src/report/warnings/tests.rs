use crate::test_turns::{SOLVED, TAKE, ball, environment, even_environment, film, known, read};
use crate::{
    LightVerdict, ReadTurn, RotationDirection, RotationSource, TableRotation, TurnWarning,
    solve_turn,
};

#[test]
fn a_turn_in_its_own_light_has_no_warnings() {
    let (turn, solution) = &*SOLVED;
    let options = known(&environment());
    assert_eq!(
        TurnWarning::of_solution(turn, &options, solution),
        Vec::new()
    );
    assert_eq!(TurnWarning::of_direction(turn, solution), None);
    assert!(solution.is_whole(turn));
}

#[test]
fn an_even_given_light_damage_and_missing_angles_are_told_in_order() {
    let options = known(&even_environment());
    let turn = ReadTurn {
        curves: film(&ball(), &environment(), TAKE),
        has_angles: false,
        damage: vec!["sample 3 is damaged".to_owned()],
        ..read(&ball(), &environment())
    };
    let solution = solve_turn(&turn.curves, &options).unwrap();
    let warnings = TurnWarning::of_solution(&turn, &options, &solution);
    let expected = [
        TurnWarning::NoAngles,
        TurnWarning::Damage("sample 3 is damaged".to_owned()),
        TurnWarning::Unfit(LightVerdict::TooEven),
        TurnWarning::GivenLightIsEven,
    ];
    assert_eq!(warnings, expected);
    assert!(!solution.is_whole(&turn));
}

#[test]
fn a_rotation_is_told_where_it_was_not_given_and_is_not_the_usual_one() {
    let mut turn = read(&ball(), &environment());
    let (usual, other) = (RotationDirection::default(), RotationDirection::Clockwise);
    let taken = |by_background| TurnWarning::TakenRotation {
        direction: other,
        by_background,
    };
    let assumed = TurnWarning::AssumedRotation { direction: usual };
    for (direction, source, expected) in [
        (usual, RotationSource::Assumed, Some(assumed)),
        (usual, RotationSource::Network, None),
        (other, RotationSource::Network, Some(taken(false))),
        (usual, RotationSource::Background, None),
        (other, RotationSource::Background, Some(taken(true))),
        (other, RotationSource::Given, None),
    ] {
        turn.rotation = TableRotation { direction, source };
        assert_eq!(TurnWarning::of_rotation(&turn), expected);
    }
    assert!(
        taken(true)
            .to_string()
            .contains("the background of the video moves that way")
    );
}

#[test]
fn a_video_whose_sides_differ_is_no_check_of_the_direction() {
    let warning = TurnWarning::of_background(None).unwrap();
    assert_eq!(warning, TurnWarning::NoPanoramaStrip);
    assert!(
        warning
            .to_string()
            .contains("does not tell the rotation direction"),
        "{warning}"
    );
}
