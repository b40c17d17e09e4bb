//! What is wrong with a mask's shape, as sentences.

use crate::{DoubtfulRegion, ShapeCheck};

/// Parts of the object that are not in the mask may have this share of its area, where all of the turn is looked at.
const MAX_REGION: f64 = 0.01;
/// The same of parts of the mask that are background: what they show is known better.
const MAX_LEAK: f64 = 0.0025;
/// The same of a look at a few frames, which takes shadows for parts of the object.
const MAX_REGION_OF_A_LOOK: f64 = 0.03;
/// The mask's outline follows what moves at least so well, compared with the turn's own.
const MIN_OUTLINE: f32 = 0.85;
/// Where it follows it better than the turn's own, what only that has is the turn's mistake.
const BETTER_OUTLINE: f32 = 1.05;
/// A mask with more of its area wrong than this share is that of something else.
const SOMETHING_ELSE: f64 = 0.2;
/// Where its outline is that of what stands still, so much of it has to be background: what changes by itself, such as a
/// display on the object, looks so too.
const MOSTLY_BACKGROUND: f64 = 0.5;
/// Regions that are named.
const NAMED: usize = 3;

impl ShapeCheck {
    /// Why the mask is not that of the object, one sentence each; empty if it is. For a turn that was looked
    /// at as a whole.
    pub fn faults(&self) -> Vec<String> {
        let mut faults = faults(self, MAX_LEAK, MAX_REGION);
        if !self.whiskers.is_empty() {
            faults.push(format!(
                "thin parts of the mask that are not the object, as pieces of the table's rim, at {}: mark them black, in --edit or in seeds",
                places(&self.whiskers)
            ));
        }
        faults
    }

    /// [`Self::faults`] after a look at only a few frames of the turn.
    pub fn quick_faults(&self) -> Vec<String> {
        faults(self, MAX_REGION_OF_A_LOOK, MAX_REGION_OF_A_LOOK)
    }

    /// Whether the mask is that of another object or recording, rather than one with a flaw: much of it is background,
    /// or much of the object is not in it.
    pub fn is_of_another_object(&self) -> bool {
        let share = |regions: &[DoubtfulRegion]| {
            let px: u64 = regions.iter().map(|region| region.px).sum();
            px as f64 / self.area_px as f64
        };
        let most_background = if self.follows_what_moves() {
            MOSTLY_BACKGROUND
        } else {
            SOMETHING_ELSE
        };
        let misses = !self.is_better_than_turn() && share(&self.missing) > SOMETHING_ELSE;
        share(&self.leaks) > most_background || misses
    }

    /// Whether the mask's outline follows what moves better than the turn's own.
    fn is_better_than_turn(&self) -> bool {
        self.outline > BETTER_OUTLINE * self.outline_of_turn
    }

    fn follows_what_moves(&self) -> bool {
        self.outline >= MIN_OUTLINE * self.outline_of_turn
    }
}

fn faults(shape: &ShapeCheck, most_leak: f64, most_region: f64) -> Vec<String> {
    let mut faults = Vec::new();
    if !shape.contradicted && !shape.follows_what_moves() {
        faults.push(format!(
            "the mask's outline does not follow what moves differently ({:.2}; the turn's own {:.2}): make it again, with --auto or --edit",
            shape.outline, shape.outline_of_turn
        ));
    }
    let area = shape.area_px as f64;
    let most_missing = if shape.is_better_than_turn() {
        f64::INFINITY
    } else {
        most_region
    };
    let named = [
        (&shape.leaks, most_leak, "background in the mask", "black"),
        (
            &shape.missing,
            most_missing,
            "object outside the mask",
            "white",
        ),
    ];
    for (regions, most, what, colour) in named {
        let px: u64 = regions.iter().map(|region| region.px).sum();
        if px as f64 > most * area {
            faults.push(format!(
                "{what}, {px} pixels ({:.1} % of it), at {}: mark it {colour}, in --edit or in seeds",
                100.0 * px as f64 / area,
                places(regions)
            ));
        }
    }
    faults
}

fn places(regions: &[DoubtfulRegion]) -> String {
    let named: Vec<String> = regions
        .iter()
        .take(NAMED)
        .map(|region| region.bounds.to_string())
        .collect();
    let more = regions.len().saturating_sub(NAMED);
    match more {
        0 => named.join(" and "),
        _ => format!("{} and {more} more", named.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relit_data::geometry::Rect;

    /// A mask of 1000 pixels, with parts of so many pixels that are leaks, missing.
    fn shape([leaks, missing]: [u64; 2]) -> ShapeCheck {
        let of = |px| {
            vec![DoubtfulRegion {
                px,
                bounds: Rect::new(0, 0, 10, 10),
            }]
        };
        ShapeCheck {
            area_px: 1000,
            outline: 0.9,
            outline_of_turn: 0.9,
            contradicted: false,
            leaks: of(leaks),
            whiskers: Vec::new(),
            missing: of(missing),
        }
    }

    #[test]
    fn background_in_a_mask_counts_sooner_than_what_it_lacks_and_whiskers_count_always() {
        assert!(shape([2, 9]).faults().is_empty());
        assert_eq!(shape([4, 9]).faults().len(), 1);
        assert!(shape([4, 9]).quick_faults().is_empty());
        let mut with_whisker = shape([0; 2]);
        with_whisker.whiskers = with_whisker.leaks.clone();
        assert_eq!(with_whisker.faults().len(), 1);
        assert!(with_whisker.quick_faults().is_empty());
    }

    #[test]
    fn a_mask_without_much_of_the_object_is_that_of_something_else() {
        assert!(!shape([150, 190]).is_of_another_object());
        let beside = |leaks| ShapeCheck {
            outline: 0.5,
            ..shape([leaks, 0])
        };
        assert!(!beside(190).is_of_another_object());
        assert!(beside(210).is_of_another_object());
        // A display on the object, whose outline is right, and a mask of the table.
        assert!(!shape([400, 0]).is_of_another_object());
        assert!(shape([510, 0]).is_of_another_object());
        assert!(shape([0, 210]).is_of_another_object());
    }
}
