//! What a person should look at before the mask is used.

use std::fmt;

use super::bitmap::{Bitmap, Part};
use super::cleanup::Cleaned;
use super::{Hints, Seeds};
use relit_data::geometry::Rect;

/// Under this part of the frame a mask is small.
const SMALL: f64 = 0.005;
/// Over this part of the frame a mask is large.
const LARGE: f64 = 0.9;
/// Dropped parts and filled holes are worth a word from this part of the mask's area on.
const LARGE_PART: f64 = 0.05;
/// From this part of the rectangle on the mask nearly equals it.
const NEARLY_RECT: f64 = 0.97;

/// A side of the frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// x = 0.
    Left,
    /// y = 0.
    Top,
    /// The greatest x.
    Right,
    /// The greatest y.
    Bottom,
}

/// Something about a mask, or about how it was made, that its user has to look at.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The rectangle reaches beyond the frame; only `used` counts.
    RectClipped {
        /// The rectangle as given.
        given: Rect,
        /// The part of it that lies in the frame.
        used: Rect,
    },
    /// The seeds hold pixels of a colour that stands for nothing.
    ColouredSeeds {
        /// How many, taken as unknown.
        px: u64,
    },
    /// The mask reaches the frame's border.
    TouchesBorder {
        /// Where.
        sides: Vec<Side>,
    },
    /// The mask is a very small part of the frame.
    Small {
        /// Its part of the frame, 0..=1.
        fraction: f64,
    },
    /// The mask is nearly all of the frame.
    Large {
        /// Its part of the frame, 0..=1.
        fraction: f64,
    },
    /// Parts of a size that may belong to the object were dropped.
    PartsDropped {
        /// How many.
        count: usize,
        /// Where the largest is.
        largest: Rect,
    },
    /// Pixels that the seeds mark as object were dropped with the part that they are in.
    MarksDropped {
        /// How many.
        px: u64,
    },
    /// A hole of a size that may be an opening was filled.
    HoleFilled {
        /// Its area, pixels.
        px: u64,
        /// Where it is.
        bounds: Rect,
    },
    /// The mask is the rectangle, more or less: nothing was cut.
    NearlyRect {
        /// The part of the rectangle that the mask fills, 0..=1.
        fraction: f64,
    },
    /// The recipe was followed on another frame, or by other software, and gave another mask.
    NotReproduced,
}

/// What is to be said of a mask that was cut by these hints.
pub(super) fn of(
    hints: &Hints,
    used: Option<Rect>,
    cleaned: &Cleaned,
    size: (u32, u32),
) -> Vec<Warning> {
    let area = cleaned.mask.count() as f64;
    let fraction = area / (f64::from(size.0) * f64::from(size.1));
    let coloured = hints.seeds().map_or(0, Seeds::coloured_px);
    let marks = cleaned.dropped_marks_px;
    [
        clipped(hints.rect(), used),
        (coloured > 0).then_some(Warning::ColouredSeeds { px: coloured }),
        touches(cleaned.mask.bounds(), size),
        (fraction < SMALL).then_some(Warning::Small { fraction }),
        (fraction > LARGE).then_some(Warning::Large { fraction }),
        dropped(&cleaned.dropped, area),
        (marks > 0).then_some(Warning::MarksDropped { px: marks }),
        filled(&cleaned.holes, area),
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

fn dropped(parts: &[Part], area: f64) -> Option<Warning> {
    let large = parts
        .iter()
        .filter(|part| part.area as f64 >= LARGE_PART * area);
    let largest = large.clone().max_by_key(|part| part.area)?.bounds;
    let count = large.count();
    Some(Warning::PartsDropped { count, largest })
}

fn filled(holes: &[Part], area: f64) -> Option<Warning> {
    let largest = holes.iter().max_by_key(|hole| hole.area)?;
    let (px, bounds) = (largest.area, largest.bounds);
    (px as f64 >= LARGE_PART * area).then_some(Warning::HoleFilled { px, bounds })
}

fn nearly_rect(rect: Rect, mask: &Bitmap) -> Option<Warning> {
    // Only seeds can mark object outside the rectangle; that is a shape of its own.
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
                "the rectangle {given} reaches beyond the frame and was cut to {used}: check its numbers"
            ),
            Self::ColouredSeeds { px } => write!(
                f,
                "{px} coloured pixels of the seeds were taken as unknown: only white marks the object and only black the background"
            ),
            Self::TouchesBorder { sides } => {
                let sides: Vec<String> = sides.iter().map(Side::to_string).collect();
                write!(
                    f,
                    "the mask touches the {} border of the frame: the object is cut off there, or background was taken for it",
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
                "the mask covers {:.0} % of the frame: check that background was not taken for the object",
                100.0 * fraction
            ),
            Self::PartsDropped { count, largest } => write!(
                f,
                "{count} large part(s) were dropped, the largest at {largest}: if they belong to the object, mark what joins them white in seeds, or give --keep-all"
            ),
            Self::MarksDropped { px } => write!(
                f,
                "{px} pixels that the seeds mark as object are not in the mask, because they hang together with no more than a smaller part: mark what joins the parts, or give --keep-all"
            ),
            Self::HoleFilled { px, bounds } => write!(
                f,
                "a hole of {px} pixels at {bounds} was filled: if one looks through the object there, mark the opening black in seeds"
            ),
            Self::NearlyRect { fraction } => write!(
                f,
                "the mask fills {:.0} % of the rectangle: nearly nothing was cut away; draw the rectangle a little larger, or give seeds",
                100.0 * fraction
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

    fn warnings(rows: &[&str], rect: Rect) -> Vec<Warning> {
        let raw = Bitmap::drawn(rows);
        let size = (rows[0].len() as u32, rows.len() as u32);
        let cleaned = super::super::cleanup::clean(&raw, None, false);
        let used = rect.clipped_to(size.0, size.1);
        of(&Hints::Rect(rect), used, &cleaned, size)
    }

    #[test]
    fn a_mask_in_the_middle_is_not_worth_a_word() {
        let rows = [".......", "..##...", "..###..", "......."];
        assert_eq!(warnings(&rows, Rect::new(1, 1, 5, 2)), []);
    }

    #[test]
    fn a_mask_at_the_border_is_told_with_its_sides() {
        let rows = [".......", ".....##", "......#"];
        let found = warnings(&rows, Rect::new(1, 1, 9, 2));
        let sides = vec![Side::Right, Side::Bottom];
        assert!(found.contains(&Warning::TouchesBorder { sides }));
        let (given, used) = (Rect::new(1, 1, 9, 2), Rect::new(1, 1, 6, 2));
        assert!(found.contains(&Warning::RectClipped { given, used }));
    }

    #[test]
    fn a_mask_that_is_the_rectangle_is_told() {
        let rows = [".....", ".###.", ".###.", "....."];
        let wanted = [Warning::NearlyRect { fraction: 1.0 }];
        assert_eq!(warnings(&rows, Rect::new(1, 1, 3, 2)), wanted);
    }

    #[test]
    fn large_dropped_parts_and_large_holes_are_told() {
        let rows = [".......", ".###.#.", ".#.#.#.", ".###...", "......."];
        let (largest, bounds) = (Rect::new(5, 1, 1, 2), Rect::new(2, 2, 1, 1));
        let wanted = [
            Warning::PartsDropped { count: 1, largest },
            Warning::HoleFilled { px: 1, bounds },
        ];
        assert_eq!(warnings(&rows, Rect::new(0, 0, 7, 5)), wanted);
    }

    #[test]
    fn every_warning_is_one_line() {
        for warning in warnings(&["##", "##"], Rect::new(-1, 0, 9, 2)) {
            assert!(!warning.to_string().contains('\n'));
        }
    }
}
