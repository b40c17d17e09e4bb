//! From GrabCut's result to a mask: small components dropped, holes filled.

use super::Mark;
use super::bitmap::{Bitmap, Component, Connectivity};

/// A component with at least this share of the largest one's area is kept.
const KEPT_FROM: f64 = 0.3;

/// The cleaned mask, and what was changed.
#[derive(Debug)]
pub(super) struct CleanedMask {
    pub(super) mask: Bitmap,
    /// Number of 8-connected components before the clean-up.
    pub(super) components: usize,
    /// Number of components that were kept.
    pub(super) kept: usize,
    /// The components that were dropped, in the order of their first pixels.
    pub(super) dropped: Vec<Component>,
    /// Pixels that the seeds mark as object and that were dropped nevertheless.
    pub(super) dropped_marks_px: u64,
    /// The holes that were filled, in the order of their first pixels.
    pub(super) holes: Vec<Component>,
    /// The largest of them that what the seeds mark as object encloses.
    pub(super) closed_by_marks: Option<Component>,
}

/// Keeps the largest component and those of a similar size, or with `keep_all` every one, and fills
/// holes of at most `fill_to` times the object's area, except those in which the seeds mark background.
pub(super) fn clean(raw: &Bitmap, marks: &[Mark], keep_all: bool, fill_to: f64) -> CleanedMask {
    let components = raw.components(Connectivity::Eight);
    let largest = components.largest();
    let least = largest.map_or(0.0, |at| components.list[at].area as f64 * KEPT_FROM);
    let is_kept = |component: usize| keep_all || components.list[component].area as f64 >= least;
    let kept = raw.map(|at, _| components.at(at).is_some_and(is_kept));
    let (mask, holes, closed_by_marks) = fill_holes(&kept, marks, fill_to);
    let all = || components.list.iter().enumerate();
    CleanedMask {
        components: components.list.len(),
        kept: all().filter(|&(index, _)| is_kept(index)).count(),
        dropped: all()
            .filter(|&(index, _)| !is_kept(index))
            .map(|(_, component)| *component)
            .collect(),
        dropped_marks_px: marked(marks, Mark::Object)
            .filter(|&at| !mask.bits().get(at).copied().unwrap_or(true))
            .count() as u64,
        mask,
        holes,
        closed_by_marks,
    }
}

/// Fills the holes: background that is not 4-connected to the border (4, because the object is
/// 8-connected).
fn fill_holes(
    object: &Bitmap,
    marks: &[Mark],
    fill_to: f64,
) -> (Bitmap, Vec<Component>, Option<Component>) {
    let ground = object.inverted();
    let components = ground.components(Connectivity::Four);
    let most = object.count() as f64 * fill_to;
    let mut is_hole: Vec<bool> = components
        .list
        .iter()
        .map(|part| part.area as f64 <= most && object.is_inside(part))
        .collect();
    for index in marked(marks, Mark::Background).filter_map(|at| components.at(at)) {
        is_hole[index] = false;
    }
    let in_hole = |at: usize| components.at(at).is_some_and(|index| is_hole[index]);
    let filled = object.map(|at, bit| bit || in_hole(at));
    let holes = components.list.iter().zip(&is_hole);
    let holes = holes.filter(|&(_, &hole)| hole);
    let holes: Vec<Component> = holes.map(|(hole, _)| *hole).collect();
    let width = object.width();
    let beside = |at: usize| {
        let above = at.checked_sub(width);
        [at.checked_sub(1), Some(at + 1), above, Some(at + width)]
    };
    let closed = marked(marks, Mark::Object).flat_map(beside).flatten();
    let closed = closed.filter_map(|at| components.at(at).filter(|&index| is_hole[index]));
    let largest = closed
        .map(|index| components.list[index])
        .max_by_key(|hole| hole.area);
    (filled, holes, largest)
}

/// The pixels that the seeds mark as `wanted`.
fn marked(marks: &[Mark], wanted: Mark) -> impl Iterator<Item = usize> {
    let marks = marks.iter().enumerate();
    marks
        .filter(move |&(_, &mark)| mark == wanted)
        .map(|(at, _)| at)
}

#[cfg(test)]
mod tests {
    use super::*;

    const RING: [&str; 6] = [
        "#......", //
        ".####..", //
        ".#..#..", //
        ".####.#", //
        "......#", //
        ".......",
    ];

    /// Marks in the ring's picture.
    fn seeds(marked: &[(usize, usize, Mark)]) -> Vec<Mark> {
        let mut marks = vec![Mark::Unknown; 7 * 6];
        for &(x, y, mark) in marked {
            marks[7 * y + x] = mark;
        }
        marks
    }

    #[test]
    fn the_largest_component_is_kept_and_its_hole_is_filled() {
        let cleaned = clean(&Bitmap::drawn(&RING), &[], false, 1.0);
        let wanted = [
            "#......", ".####..", ".####..", ".####..", ".......", ".......",
        ];
        assert_eq!(cleaned.mask, Bitmap::drawn(&wanted));
        assert_eq!((cleaned.components, cleaned.kept), (2, 1));
        assert_eq!(cleaned.dropped[0].area, 2);
        assert_eq!(cleaned.holes[0].area, 2);
    }

    #[test]
    fn every_component_is_kept_on_request() {
        let cleaned = clean(&Bitmap::drawn(&RING), &[], true, 1.0);
        assert_eq!((cleaned.components, cleaned.kept), (2, 2));
        assert!(cleaned.dropped.is_empty());
        assert_eq!(cleaned.mask.count(), 15);
    }

    #[test]
    fn a_hole_marked_as_background_stays_open() {
        let marks = seeds(&[(1, 1, Mark::Object), (2, 2, Mark::Background)]);
        let cleaned = clean(&Bitmap::drawn(&RING), &marks, false, 1.0);
        assert!(cleaned.holes.is_empty());
        assert_eq!(cleaned.mask.count(), 11);
    }

    #[test]
    fn a_hole_that_a_mark_closed_is_named_and_others_are_not() {
        let open = clean(&Bitmap::drawn(&RING), &[], false, 1.0);
        assert_eq!(open.closed_by_marks, None);
        let marks = seeds(&[(3, 1, Mark::Object)]);
        let closed = clean(&Bitmap::drawn(&RING), &marks, false, 1.0);
        assert_eq!(closed.closed_by_marks.map(|hole| hole.area), Some(2));
    }

    #[test]
    fn a_dropped_mark_is_counted() {
        let marks = seeds(&[(6, 4, Mark::Object), (1, 1, Mark::Object)]);
        let cleaned = clean(&Bitmap::drawn(&RING), &marks, false, 1.0);
        assert_eq!(cleaned.dropped_marks_px, 1);
    }

    #[test]
    fn a_bay_that_is_open_to_the_border_is_not_a_hole() {
        let bay = Bitmap::drawn(&["###", "#.#", "#.#"]);
        assert_eq!(clean(&bay, &[], false, 1.0).mask, bay);
    }
}
