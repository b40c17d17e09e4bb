//! Openings that a person's marks closed: what one looked through before, and is inside the object now.

use super::bitmap::{Bitmap, Component, Connectivity};

/// A narrower change is one of the edge, pixels to each side.
const NARROW: usize = 1;

/// The largest part that is object only after a change, and lies inside it.
pub(super) fn enclosed(before: &Bitmap, after: &Bitmap) -> Option<Component> {
    let added = after.map(|at, bit| bit && !before.bits()[at]);
    let wide = added.inverted().dilated(NARROW).inverted().dilated(NARROW);
    let added = added.map(|at, bit| bit && wide.bits()[at]);
    let near_ground = after.inverted().dilated(1);
    let components = added.components(Connectivity::Eight);
    let mut inside = vec![true; components.list.len()];
    for (at, _) in near_ground
        .bits()
        .iter()
        .enumerate()
        .filter(|(_, near)| **near)
    {
        if let Some(index) = components.at(at) {
            inside[index] = false;
        }
    }
    let parts = components.list.iter().zip(inside);
    let parts = parts.filter(|(_, inside)| *inside).map(|(part, _)| *part);
    parts.max_by_key(|part| part.area)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_opening_that_was_painted_over_is_inside_and_an_added_arm_is_not() {
        let before = Bitmap::drawn(&[
            ".............",
            ".#######.....",
            ".#...###.....",
            ".#...###.....",
            ".#...###.....",
            ".#######.....",
            ".............",
        ]);
        let after = before.map(|at, bit| {
            let (x, y) = (at % 13, at / 13);
            bit || (2..5).contains(&x) && (2..5).contains(&y)
        });
        assert_eq!(enclosed(&before, &after).map(|hole| hole.area), Some(9));
        let arm = before.map(|at, bit| {
            let (x, y) = (at % 13, at / 13);
            bit || (8..12).contains(&x) && (2..5).contains(&y)
        });
        assert_eq!(enclosed(&before, &arm), None);
    }
}
