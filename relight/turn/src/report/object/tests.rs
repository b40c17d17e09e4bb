use crate::tests::{SIDE, SOLVED};

#[test]
fn a_turn_becomes_an_object_whose_edge_has_its_own_colour() {
    let (turn, solution) = &*SOLVED;
    let asset = solution.captured_object(turn).unwrap();
    assert_eq!(asset.name(), "ball");
    assert!(asset.alpha().pixel(SIDE / 2, SIDE / 2)[0] > 0.99);
    let mut partly = 0;
    for (at, &alpha) in asset.alpha().plane(0).iter().enumerate() {
        if alpha > 0.0 {
            let albedo = asset.surface().albedo().planes().plane(1)[at];
            assert!(albedo > 0.03, "{albedo}");
        }
        partly += usize::from(alpha > 0.1 && alpha < 0.9);
    }
    assert!(partly > SIDE, "{partly}");
}
