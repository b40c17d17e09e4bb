use crate::TurnVerdict;
use crate::model::material::MaterialKind;
use crate::observe::conditioning::Conditioning;
use crate::tests::{TAKE, Take, ball, environment, film};

#[test]
fn expected_errors_and_the_coverage_decide() {
    let of =
        |part| Conditioning::from_curves(&film(&ball(), &environment(), Take { part, ..TAKE }));
    let good = of(1.0);
    assert_eq!(good.coverage_deg, 360.0);
    let (matt, metal) = (MaterialKind::Diffuse, MaterialKind::Metal);
    for (degrees, material, verdict) in [
        (10.0, matt, TurnVerdict::Good),
        (45.0, matt, TurnVerdict::Uncertain),
        (10.0, metal, TurnVerdict::Uncertain),
    ] {
        assert_eq!(good.expecting(degrees, material).verdict, verdict);
    }
    let part = of(245.0 / 360.0);
    assert!((part.coverage_deg - 245.0).abs() <= 5.0, "{part:?}");
    let verdict = part.expecting(10.0, matt).verdict;
    assert_eq!(verdict, TurnVerdict::PartOfTurn);
    assert!(!verdict.is_fit() && verdict.advice().is_some());
}
