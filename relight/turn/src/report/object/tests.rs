use relight_core::image::{Extent, Planes};

use super::coverage;
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

/// The part of a pixel that lies below a slanted line, and within a strip of two pixels, by 8 x 8 samples.
fn slanted(x: usize, y: usize) -> f32 {
    let inside = (0..64).filter(|k| {
        let [x, y] = [(x, k % 8), (y, k / 8)].map(|(at, k)| at as f32 + (k as f32 + 0.5) / 8.0);
        y > 20.3 + 0.17 * x
    });
    inside.count() as f32 / 64.0
}

#[test]
fn the_edge_of_a_mask_without_soft_values_has_no_steps() {
    let extent = Extent::new(64, 64);
    let mask = Planes::from_fn(extent, |x, y| [slanted(x, y).round()]);
    let found = coverage(&mask);
    let error = |alpha: &Planes<1>| {
        let pixels = (8..56).flat_map(|y| (8..56).map(move |x| (x, y)));
        pixels
            .map(|(x, y)| (alpha.pixel(x, y)[0] - slanted(x, y)).abs())
            .sum::<f32>()
    };
    assert!(
        error(&found) < 0.5 * error(&mask),
        "{} {}",
        error(&found),
        error(&mask)
    );
    // It is one pixel wide.
    let partly = (0..64)
        .filter(|&y| (0.01..0.99).contains(&found.pixel(32, y)[0]))
        .count();
    assert!((1..=2).contains(&partly), "{partly}");
}

#[test]
fn what_is_thin_stays_and_a_mask_of_soft_values_is_taken_as_it_is() {
    let extent = Extent::new(32, 32);
    let stick = Planes::from_fn(extent, |x, y| {
        [f32::from(u8::from(
            (15..17).contains(&x) && (4..28).contains(&y),
        ))]
    });
    let found = coverage(&stick);
    assert!(found.pixel(15, 16)[0] > 0.4 && found.pixel(13, 16)[0] < 0.1);
    let soft = Planes::from_fn(extent, |x, y| [slanted(x, y)]);
    for (found, given) in coverage(&soft).plane(0).iter().zip(soft.plane(0)) {
        assert!((found - given).abs() < 0.03);
    }
}
