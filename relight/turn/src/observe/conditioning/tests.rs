use crate::TurnVerdict;
use crate::observe::conditioning::Conditioning;
use crate::tests::{SOLVED, TAKE, Take, ball, environment, even_environment, film, solve};
use relight_core::light::ShLight;

#[test]
fn an_even_light_is_not_trusted_though_it_was_given() {
    // Of the turn that it lit, and of one that another light did.
    for light in [even_environment(), environment()] {
        let curves = film(&ball(), &light, TAKE);
        let found = solve(&curves, &even_environment());
        assert_eq!(found.verdict(), TurnVerdict::TooEven);
        let expected = found.expected_error_deg();
        assert!(expected > 45.0, "{expected}");
    }
    let found = SOLVED.1.conditioning;
    assert_eq!(found.verdict, TurnVerdict::Good);
    let ratio = found.given_modulation.unwrap() / found.modulation;
    assert!((0.5..2.0).contains(&ratio), "{found:?}");
}

#[test]
fn even_light_is_called_too_even() {
    let surface = ball();
    let good = Conditioning::from_curves(&film(&surface, &environment(), TAKE));
    assert_eq!(good.verdict, TurnVerdict::Good);
    assert!(good.verdict.advice().is_none());
    let bad = Conditioning::from_curves(&film(&surface, &even_environment(), TAKE));
    assert_eq!(bad.verdict, TurnVerdict::TooEven);
    assert!(bad.verdict.advice().is_some());
}

#[test]
fn the_network_s_errors_and_the_coverage_decide_where_the_light_is_not_known() {
    let of = |light: ShLight, part| {
        Conditioning::from_curves(&film(&ball(), &light, Take { part, ..TAKE }))
    };
    let good = of(environment(), 1.0);
    assert_eq!(good.coverage_deg, 360.0);
    assert_eq!(good.by_network(10.0).verdict, TurnVerdict::Good);
    assert_eq!(good.by_network(45.0).verdict, TurnVerdict::Uncertain);
    // An even light is the network's affair.
    let even = of(even_environment(), 1.0);
    assert_eq!(even.by_network(10.0).verdict, TurnVerdict::Good);
    let part = of(environment(), 245.0 / 360.0);
    assert!((part.coverage_deg - 245.0).abs() <= 5.0, "{part:?}");
    let verdict = part.by_network(10.0).verdict;
    assert_eq!(verdict, TurnVerdict::PartOfTurn);
    assert!(!verdict.is_fit() && verdict.advice().is_some());
}
