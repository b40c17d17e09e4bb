use crate::test_turns::{SOLVED, TAKE, ball, environment, even_environment, film, known};
use crate::{Conditioning, LightVerdict, solve_turn};

#[test]
fn an_even_light_is_not_trusted_though_it_was_given() {
    // Of the turn that it lit, and of one that another light did.
    for (light, is_at_odds) in [(even_environment(), false), (environment(), true)] {
        let curves = film(&ball(), &light, TAKE);
        let found = solve_turn(&curves, &known(&even_environment())).unwrap();
        let conditioning = found.conditioning();
        assert_eq!(conditioning.verdict, LightVerdict::TooEven);
        assert_eq!(conditioning.is_given_at_odds(), is_at_odds);
        let expected = found.expected_error_deg();
        assert!(expected > 45.0, "{expected}");
    }
    let found = SOLVED.1.conditioning();
    assert_eq!(found.verdict, LightVerdict::Good);
    assert!(!found.is_given_at_odds());
    let ratio = found.given_modulation.unwrap() / found.modulation;
    assert!((0.5..2.0).contains(&ratio), "{found:?}");
}

#[test]
fn even_light_is_called_too_even() {
    let surface = ball();
    let good = Conditioning::of(&film(&surface, &environment(), TAKE));
    assert_eq!(good.verdict, LightVerdict::Good);
    assert!(good.verdict.advice().is_none());
    let bad = Conditioning::of(&film(&surface, &even_environment(), TAKE));
    assert_eq!(bad.verdict, LightVerdict::TooEven);
    let advice = bad.verdict.advice().unwrap();
    assert!(advice.contains("turn on one lamp"), "{advice}");
}

#[test]
fn a_light_that_cannot_be_makes_a_good_turn_unfit_and_keeps_the_reason_of_a_bad_one() {
    let surface = ball();
    let good = Conditioning::of(&film(&surface, &environment(), TAKE));
    assert_eq!(good.in_found(true).verdict, LightVerdict::Good);
    let refused = good.in_found(false).verdict;
    assert_eq!(refused, LightVerdict::ImpossibleLight);
    assert!(!refused.is_fit());
    assert!(refused.advice().unwrap().contains("--light"));
    let even = Conditioning::of(&film(&surface, &even_environment(), TAKE));
    assert_eq!(even.in_found(false).verdict, LightVerdict::TooEven);
}
