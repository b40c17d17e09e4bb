//! Warnings: what a person should check before using a mask.

use std::fmt;

use relit_data::geometry::Rect;

use super::bitmap::{Bitmap, Component};
use super::cleanup::Cleaned;
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

/// A side of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// x = 0.
    Left,
    /// y = 0.
    Top,
    /// The largest x.
    Right,
    /// The largest y.
    Bottom,
}

/// Something about a mask, or about how it was made, that its user should check.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The rectangle extends beyond the frame; only `used` counts.
    RectClipped {
        /// The rectangle as given.
        given: Rect,
        /// The part of it that is inside the frame.
        used: Rect,
    },
    /// The seeds have coloured pixels, which have no meaning.
    ColouredSeeds {
        /// Number of such pixels, which count as unknown.
        px: u64,
    },
    /// The mask touches the frame's border.
    TouchesBorder {
        /// The sides that it touches.
        sides: Vec<Side>,
    },
    /// The mask covers very little of the frame.
    Small {
        /// The fraction of the frame, 0..=1.
        fraction: f64,
    },
    /// The mask covers nearly the whole frame.
    Large {
        /// The fraction of the frame, 0..=1.
        fraction: f64,
    },
    /// Large connected components, which may belong to the object, were dropped.
    PartsDropped {
        /// Number of such components.
        count: usize,
        /// Bounds of the largest.
        largest: Rect,
    },
    /// Pixels that the seeds mark as object were dropped with their component.
    MarksDropped {
        /// Number of such pixels.
        px: u64,
    },
    /// A hole, which may be an opening of the object, was filled: a large one, or one that marks closed.
    HoleFilled {
        /// Its area, pixels.
        px: u64,
        /// Its bounds.
        bounds: Rect,
    },
    /// The mask nearly equals the rectangle: hardly anything was cut away.
    NearlyRect {
        /// The fraction of the rectangle that the mask covers, 0..=1.
        fraction: f64,
    },
    /// What the turn shows was not used; the hints alone decided.
    TurnDropped {
        /// Why.
        why: String,
    },
    /// Hardly anything changes over the video.
    NothingMoves,
    /// Following a recipe on another frame, or with other software, gave another mask.
    NotReproduced,
}

/// The warnings about a mask that was made with these hints.
pub(super) fn warnings(
    hints: Option<&Hints>,
    used: Option<Rect>,
    cleaned: &Cleaned,
    size: (u32, u32),
) -> Vec<Warning> {
    let area = cleaned.mask.count() as f64;
    let fraction = area / (f64::from(size.0) * f64::from(size.1));
    let coloured = hints.and_then(Hints::seeds).map_or(0, Seeds::coloured_px);
    let marks = cleaned.dropped_marks_px;
    [
        clipped(hints.and_then(Hints::rect), used),
        (coloured > 0).then_some(Warning::ColouredSeeds { px: coloured }),
        touches(cleaned.mask.bounds(), size),
        (fraction < SMALL).then_some(Warning::Small { fraction }),
        (fraction > LARGE).then_some(Warning::Large { fraction }),
        dropped(&cleaned.dropped, area),
        (marks > 0).then_some(Warning::MarksDropped { px: marks }),
        filled(cleaned, area),
        used.and_then(|rect| nearly_rect(rect, &cleaned.mask)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

fn clipped(given: Option<Rect>, used: Option<Rect>) -> Option<Warning> {
    let (given, used) = (given?, used?);
    (given != used).then_some(Warning::RectClipped { given, used })
}

fn touches(bounds: Rect, (width, height): (u32, u32)) -> Option<Warning> {
    let sides: Vec<Side> = [
        (bounds.x == 0, Side::Left),
        (bounds.y == 0, Side::Top),
        (bounds.right() == i64::from(width), Side::Right),
        (bounds.bottom() == i64::from(height), Side::Bottom),
    ]
    .into_iter()
    .filter_map(|(there, side)| there.then_some(side))
    .collect();
    (!sides.is_empty()).then_some(Warning::TouchesBorder { sides })
}

fn dropped(components: &[Component], area: f64) -> Option<Warning> {
    let large = components
        .iter()
        .filter(|component| component.area as f64 >= LARGE_PART * area);
    let largest = large.clone().max_by_key(|component| component.area)?.bounds;
    let count = large.count();
    Some(Warning::PartsDropped { count, largest })
}

fn filled(cleaned: &Cleaned, area: f64) -> Option<Warning> {
    let largest = cleaned.holes.iter().max_by_key(|hole| hole.area);
    let large = largest.filter(|hole| hole.area as f64 >= LARGE_PART * area);
    // A person who closes an opening by mistake does not see it.
    let closed = cleaned.closed_by_marks.as_ref();
    let closed = closed.filter(|hole| hole.area as f64 >= OPENING * area);
    let &Component { area: px, bounds } = large.or(closed)?;
    Some(Warning::HoleFilled { px, bounds })
}

fn nearly_rect(rect: Rect, mask: &Bitmap) -> Option<Warning> {
    // With seeds the object can extend beyond the rectangle; then its shape is not the rectangle's.
    let bounds = mask.bounds();
    let inside = bounds.x >= rect.x
        && bounds.y >= rect.y
        && bounds.right() <= rect.right()
        && bounds.bottom() <= rect.bottom();
    let fraction = mask.count() as f64 / (f64::from(rect.w) * f64::from(rect.h));
    (inside && fraction >= NEARLY_RECT).then_some(Warning::NearlyRect { fraction })
}

impl fmt::Display for Side {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Left => "left",
            Self::Top => "upper",
            Self::Right => "right",
            Self::Bottom => "lower",
        })
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::RectClipped { given, used } => write!(
                f,
                "the rectangle {given} extends beyond the frame and was clipped to {used}: check its numbers"
            ),
            Self::ColouredSeeds { px } => write!(
                f,
                "{px} coloured pixels of the seeds count as unknown: only white marks the object and only black the background"
            ),
            Self::TouchesBorder { sides } => {
                let sides: Vec<String> = sides.iter().map(Side::to_string).collect();
                write!(
                    f,
                    "the mask touches the {} border of the frame: the object is cut off there, or background was included",
                    sides.join(", ")
                )
            }
            Self::Small { fraction } => write!(
                f,
                "the mask covers only {:.2} % of the frame: check that it is the object",
                100.0 * fraction
            ),
            Self::Large { fraction } => write!(
                f,
                "the mask covers {:.0} % of the frame: check that it does not include background",
                100.0 * fraction
            ),
            Self::PartsDropped { count, largest } => write!(
                f,
                "{count} large part(s) were dropped, the largest at {largest}: if they belong to the object, mark what connects them white in seeds, or give --keep-all"
            ),
            Self::MarksDropped { px } => write!(
                f,
                "{px} pixels that the seeds mark as object are not in the mask, because they are connected to a smaller part only: mark what connects the parts, or give --keep-all"
            ),
            Self::HoleFilled { px, bounds } => write!(
                f,
                "a hole of {px} pixels at {bounds} was filled: if one looks through the object there, mark the opening black in seeds"
            ),
            Self::NearlyRect { fraction } => write!(
                f,
                "the mask covers {:.0} % of the rectangle: hardly anything was cut away; draw the rectangle a little larger, or give seeds",
                100.0 * fraction
            ),
            Self::TurnDropped { why } => write!(
                f,
                "the turn was not used, only the rectangle or the seeds: {why}"
            ),
            Self::NothingMoves => write!(
                f,
                "hardly anything changes over the video: without a moving background the mask rests on the average colours alone; check it, or give a rectangle"
            ),
            Self::NotReproduced => {
                write!(f, "this mask differs from the one that the recipe recorded")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn warnings_of(rows: &[&str], rect: Rect) -> Vec<Warning> {
        let raw = Bitmap::drawn(rows);
        let size = (rows[0].len() as u32, rows.len() as u32);
        let cleaned = super::super::cleanup::clean(&raw, None, false, 1.0);
        let used = rect.clipped_to(size.0, size.1);
        warnings(Some(&Hints::Rect(rect)), used, &cleaned, size)
    }

    #[test]
    fn a_mask_in_the_middle_gives_no_warning() {
        let rows = [".......", "..##...", "..###..", "......."];
        assert_eq!(warnings_of(&rows, Rect::new(1, 1, 5, 2)), []);
    }

    #[test]
    fn a_mask_at_the_border_gives_a_warning_with_its_sides() {
        let rows = [".......", ".....##", "......#"];
        let found = warnings_of(&rows, Rect::new(1, 1, 9, 2));
        let sides = vec![Side::Right, Side::Bottom];
        assert!(found.contains(&Warning::TouchesBorder { sides }));
        let (given, used) = (Rect::new(1, 1, 9, 2), Rect::new(1, 1, 6, 2));
        assert!(found.contains(&Warning::RectClipped { given, used }));
    }

    #[test]
    fn a_mask_that_equals_the_rectangle_gives_a_warning() {
        let rows = [".....", ".###.", ".###.", "....."];
        let wanted = [Warning::NearlyRect { fraction: 1.0 }];
        assert_eq!(warnings_of(&rows, Rect::new(1, 1, 3, 2)), wanted);
    }

    #[test]
    fn large_dropped_parts_and_large_holes_give_warnings() {
        let rows = [".......", ".###.#.", ".#.#.#.", ".###...", "......."];
        let (largest, bounds) = (Rect::new(5, 1, 1, 2), Rect::new(2, 2, 1, 1));
        let wanted = [
            Warning::PartsDropped { count: 1, largest },
            Warning::HoleFilled { px: 1, bounds },
        ];
        assert_eq!(warnings_of(&rows, Rect::new(0, 0, 7, 5)), wanted);
    }

    #[test]
    fn every_warning_is_one_line() {
        for warning in warnings_of(&["##", "##"], Rect::new(-1, 0, 9, 2)) {
            assert!(!warning.to_string().contains('\n'));
        }
    }
}
