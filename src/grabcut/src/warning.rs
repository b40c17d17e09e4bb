//! Warnings: what a person should check before using a mask, one sentence each.

use relit_data::geometry::Rect;

use super::bitmap::{Bitmap, Component};
use super::cleanup::CleanedMask;
use super::{Hints, Seeds};

/// A mask that covers a smaller fraction of the frame is small.
const SMALL: f64 = 0.005;
/// A mask that covers a larger fraction of the frame is large.
const LARGE: f64 = 0.9;
/// Dropped components and filled holes are reported from this fraction of the mask's area on.
const LARGE_PART: f64 = 0.05;
/// A hole that marks closed is reported from this fraction of the mask's area on.
pub(super) const OPENING: f64 = 0.001;
/// A mask that covers at least this fraction of the rectangle nearly equals it.
const NEARLY_RECT: f64 = 0.97;

/// Hardly anything changes over the video.
pub(super) const NOTHING_MOVES: &str = "hardly anything changes over the video: without a moving background the mask rests on the average colours alone; check it, or give a rectangle";

/// Little overlap with the object is to be expected of a mask by the turn.
pub(super) const UNCLEAR_TURN: &str = "the turn does not show clearly what is object: check the mask, and mark object and background in --edit or in seeds";

/// Little overlap with the object is to be expected of a mask by hints.
pub(super) const UNCLEAR_PICTURE: &str = "the picture does not show clearly what is object: check the mask, and mark object and background in seeds";

/// What the turn shows was not used; the hints alone decided.
pub(super) fn turn_dropped(why: &str) -> String {
    format!("the turn was not used, only the rectangle or the seeds: {why}")
}

/// A hole, which may be an opening of the object, was filled: a large one, or one that marks closed.
pub(super) fn hole_filled(&Component { area, bounds }: &Component) -> String {
    format!(
        "a hole of {area} pixels at {bounds} was filled: if it is an opening, mark it black in seeds"
    )
}

/// The object seems to go on beyond some sides of its rectangle.
pub(super) fn cut_off(sides: &[&str]) -> String {
    format!(
        "the object seems to go on beyond the rectangle (on the {} side): if so, draw a larger one",
        sides.join(", ")
    )
}

/// The warnings about a mask that was made with these hints.
pub(super) fn warnings(
    hints: &Hints,
    used: Option<Rect>,
    cleaned: &CleanedMask,
    size: (u32, u32),
) -> Vec<String> {
    let area = cleaned.mask.count() as f64;
    let fraction = area / (f64::from(size.0) * f64::from(size.1));
    let percent = 100.0 * fraction;
    let coloured = hints.seeds.as_ref().map_or(0, Seeds::coloured_px);
    let marks = cleaned.dropped_marks_px;
    [
        clipped(hints.rect, used),
        (coloured > 0).then(|| {
            format!("{coloured} coloured pixels of the seeds count as unknown: only white marks the object and only black the background")
        }),
        touches(cleaned.mask.bounds(), size),
        (fraction < SMALL).then(|| {
            format!("the mask covers only {percent:.2} % of the frame: check that it is the object")
        }),
        (fraction > LARGE).then(|| {
            format!("the mask covers {percent:.0} % of the frame: check that it does not include background")
        }),
        dropped(&cleaned.dropped, area),
        (marks > 0).then(|| {
            format!("{marks} pixels marked as object were dropped with a smaller part: mark what connects the parts, or give --keep-all")
        }),
        filled(cleaned, area).map(hole_filled),
        used.and_then(|rect| nearly_rect(rect, &cleaned.mask)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn clipped(given: Option<Rect>, used: Option<Rect>) -> Option<String> {
    let (given, used) = (given?, used?);
    (given != used).then(|| {
        format!(
            "the rectangle {given} extends beyond the frame and was clipped to {used}: check its numbers"
        )
    })
}

fn touches(bounds: Rect, (width, height): (u32, u32)) -> Option<String> {
    let sides: Vec<&str> = [
        (bounds.x == 0, "left"),
        (bounds.y == 0, "upper"),
        (bounds.right() == i64::from(width), "right"),
        (bounds.bottom() == i64::from(height), "lower"),
    ]
    .into_iter()
    .filter_map(|(there, side)| there.then_some(side))
    .collect();
    (!sides.is_empty()).then(|| {
        format!(
            "the mask touches the {} border of the frame: the object is cut off there, or background was included",
            sides.join(", ")
        )
    })
}

fn dropped(components: &[Component], area: f64) -> Option<String> {
    let large = components
        .iter()
        .filter(|component| component.area as f64 >= LARGE_PART * area);
    let largest = large.clone().max_by_key(|component| component.area)?.bounds;
    let count = large.count();
    Some(format!(
        "{count} large part(s) were dropped, the largest at {largest}: if they belong to the object, mark what connects them white in seeds, or give --keep-all"
    ))
}

/// The hole that was filled and that is worth a warning.
pub(super) fn filled(cleaned: &CleanedMask, area: f64) -> Option<&Component> {
    let largest = cleaned.holes.iter().max_by_key(|hole| hole.area);
    let large = largest.filter(|hole| hole.area as f64 >= LARGE_PART * area);
    // A person who closes an opening by mistake does not see it.
    let closed = cleaned.closed_by_marks.as_ref();
    large.or(closed.filter(|hole| hole.area as f64 >= OPENING * area))
}

fn nearly_rect(rect: Rect, mask: &Bitmap) -> Option<String> {
    // With seeds the object can extend beyond the rectangle; then its shape is not the rectangle's.
    let bounds = mask.bounds();
    let inside = bounds.x >= rect.x
        && bounds.y >= rect.y
        && bounds.right() <= rect.right()
        && bounds.bottom() <= rect.bottom();
    let fraction = mask.count() as f64 / (f64::from(rect.w) * f64::from(rect.h));
    (inside && fraction >= NEARLY_RECT).then(|| {
        format!(
            "the mask covers {:.0} % of the rectangle: hardly anything was cut away; draw the rectangle a little larger, or give seeds",
            100.0 * fraction
        )
    })
}

#[cfg(test)]
mod tests {
    use relit_test_support::is_named;

    use super::*;

    fn warnings_of(rows: &[&str], rect: Rect) -> Vec<String> {
        let raw = Bitmap::drawn(rows);
        let size = (rows[0].len() as u32, rows.len() as u32);
        let cleaned = super::super::cleanup::clean(&raw, &[], false, 1.0);
        let used = rect.clipped_to(size.0, size.1);
        warnings(&rect.into(), used, &cleaned, size)
    }

    /// Whether these are the warnings, by what each names.
    fn are(found: &[String], wanted: &[&[&str]]) -> bool {
        let mut pairs = found.iter().zip(wanted);
        found.len() == wanted.len() && pairs.all(|(found, wanted)| is_named(found, wanted))
    }

    #[test]
    fn a_mask_in_the_middle_gives_no_warning() {
        let rows = [".......", "..##...", "..###..", "......."];
        assert!(warnings_of(&rows, Rect::new(1, 1, 5, 2)).is_empty());
    }

    #[test]
    fn a_mask_at_the_border_gives_a_warning_with_its_sides() {
        let rows = [".......", ".....##", "......#"];
        let found = warnings_of(&rows, Rect::new(1, 1, 9, 2));
        assert!(
            are(&found, &[&["1,1,9,2", "1,1,6,2"], &["right, lower"]]),
            "{found:?}"
        );
    }

    #[test]
    fn a_mask_that_equals_the_rectangle_gives_a_warning() {
        let rows = [".....", ".###.", ".###.", "....."];
        let found = warnings_of(&rows, Rect::new(1, 1, 3, 2));
        assert!(are(&found, &[&["100 %", "rectangle"]]), "{found:?}");
    }

    #[test]
    fn large_dropped_parts_and_large_holes_give_warnings() {
        let rows = [".......", ".###.#.", ".#.#.#.", ".###...", "......."];
        let wanted: [&[&str]; 2] = [&["1", "5,1,1,2"], &["hole", "1 pixels", "2,2,1,1"]];
        let found = warnings_of(&rows, Rect::new(0, 0, 7, 5));
        assert!(are(&found, &wanted), "{found:?}");
    }
}
