//! From a frame and hints to a mask.

use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;
use serde::{Deserialize, Serialize};

use super::beyond;
use super::bitmap::{Bitmap, Component, Connectivity};
use super::by_hints;
use super::cut::pyramid::{InitialModels, Pyramid};
use super::hints::trimap::Trimap;
use super::settings::{MAX_PIXELS, MIN_SIDE};
use super::turn::statistics;
use super::turn::statistics::TurnStatistics;
use super::warning::{
    NOTHING_MOVES, OPENING, UNCLEAR_PICTURE, UNCLEAR_TURN, cut_off, filled, hole_filled,
    turn_dropped, warnings,
};
use super::{Effort, Hints, Mark, MaskError, SegmentSettings, cleanup};

/// On one frame a hole of this share of the object may be a highlight, and is filled.
const FILLED_OF_FRAME: f64 = 0.01;
/// Over a turn highlights move: only specks are filled.
const FILLED_OF_TURN: f64 = 0.001;
/// The turn's outline has at least this share of the strength of the hints' one.
const MIN_OF_HINTS: f32 = 0.85;
/// A turn's mask gets a warning if its expected overlap with the object is smaller.
const UNSURE: f32 = 0.88;
/// A mask by hints gets a warning if its expected overlap is smaller.
const UNSURE_BY_HINTS: f32 = 0.75;
/// Models learn from what is around a rectangle within this share of its longer side.
const NEAR: f64 = 0.8;
/// The share of a rectangle that is background: a person leaves about half free.
const FREE_OF_RECT: f64 = 0.5;
/// A narrower change by marks is one of the edge, pixels to each side.
const NARROW: usize = 1;

/// An object's mask on one frame.
#[derive(Debug, Clone)]
pub struct Mask {
    /// The mask, in the size of the frame: 255 object, 0 background.
    pub image: GrayImage,
    /// Area, bounding box and components.
    pub statistics: MaskStatistics,
    /// What its user should check, one sentence each.
    pub warnings: Vec<String>,
    /// Whether one of them names a hole that was filled.
    names_hole: bool,
}

/// Numbers about a mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct MaskStatistics {
    /// Pixels of the object, at least 1.
    pub area_px: u64,
    /// The smallest rectangle around them.
    pub bounding_box: Rect,
    /// Connected components before the clean-up, at least 1.
    pub components: usize,
    /// Connected components that were kept.
    pub components_kept: usize,
    /// Pixels of the holes that were filled.
    pub holes_filled_px: u64,
}

/// Finds the object in `frame`. The same input gives the same mask.
///
/// # Errors
/// [`MaskError::FrameSize`]; hints that do not fit the frame ([`MaskError::Hints`]); a result without object or
/// without background ([`MaskError::Empty`], [`MaskError::Everything`]).
pub fn segment(
    frame: &RgbImage,
    hints: &Hints,
    settings: &SegmentSettings,
) -> Result<Mask, MaskError> {
    segment_with(frame, None, hints, settings, Effort::Fine)
}

/// Finds the object in `frame` by what a turn shows, if there is one, with or without hints. `turn` was made from
/// frames of the same recording. The same input gives the same mask.
///
/// With a rectangle there is a guard against a turn that misleads: if its mask has an outline along which less
/// moves differently than along that of the hints alone, the hints alone decide, and a warning says so; so it is
/// with any hints if there are too few frames.
///
/// # Errors
/// As [`segment`]; [`MaskError::FewFrames`] by a turn without hints.
pub fn segment_with(
    frame: &RgbImage,
    turn: Option<&TurnStatistics>,
    hints: &Hints,
    settings: &SegmentSettings,
    effort: Effort,
) -> Result<Mask, MaskError> {
    let hints = &*hints.painted(frame.dimensions())?;
    let mut mask = cut_unclosed(frame, turn, hints, settings, effort)?;
    if effort != Effort::Draft && !mask.names_hole {
        let closed = closed_opening(frame, turn, hints, settings, &mask);
        mask.warnings.extend(closed.as_ref().map(hole_filled));
    }
    Ok(mask)
}

/// What a mask lacks that the marks closed. It is found by a cut without the marks of the object; `None` if there is
/// no cut without them.
fn closed_opening(
    frame: &RgbImage,
    turn: Option<&TurnStatistics>,
    hints: &Hints,
    settings: &SegmentSettings,
    mask: &Mask,
) -> Option<Component> {
    if !hints.marks().contains(&Mark::Object) {
        return None;
    }
    let fewer = hints.without_object_marks();
    // Marks of the background alone show no object.
    if turn.is_none() && fewer.rect.is_none() {
        return None;
    }
    let before = cut_unclosed(frame, turn, &fewer, settings, Effort::Fine).ok()?;
    let hole = newly_enclosed(
        &Bitmap::from_mask(&before.image),
        &Bitmap::from_mask(&mask.image),
    )?;
    (hole.area as f64 >= OPENING * mask.statistics.area_px as f64).then_some(hole)
}

/// The largest part that is object only after a change, and lies inside it.
fn newly_enclosed(before: &Bitmap, after: &Bitmap) -> Option<Component> {
    let added = after.minus(before).opened(NARROW);
    let near_ground = after.inverted().dilated(1);
    let inside = added.parts_where(Connectivity::Eight, |_, part| {
        part().and(&near_ground).count() == 0
    });
    let parts = inside.components(Connectivity::Eight).list;
    parts.into_iter().max_by_key(|part| part.area)
}

/// [`segment_with`] painted hints, without a look at openings that the marks closed.
fn cut_unclosed(
    frame: &RgbImage,
    turn: Option<&TurnStatistics>,
    hints: &Hints,
    settings: &SegmentSettings,
    effort: Effort,
) -> Result<Mask, MaskError> {
    let Some(turn) = turn else {
        return cut_by_hints(frame, hints, settings, effort);
    };
    let size = frame.dimensions();
    check_size(size)?;
    let dropped = |mut mask: Mask, why: &str| {
        mask.warnings.push(turn_dropped(why));
        Ok(mask)
    };
    let by_turn = match statistics::segment(frame, turn, hints, effort) {
        Ok(by_turn) => by_turn,
        Err(error) if hints.is_empty() => return Err(error),
        Err(error) => {
            let mask = cut_by_hints(frame, hints, settings, effort)?;
            return dropped(mask, &error.to_string());
        }
    };
    let rect = used_rect(hints, size);
    if rect.is_some()
        && let Ok(other) = cut_by_hints(frame, hints, settings, effort)
        && let Some(why) = misled(turn, &by_turn, &other)
    {
        return dropped(other, &why);
    }
    let mut mask = finish(&by_turn, size, hints, rect, settings, FILLED_OF_TURN)?;
    if turn.expected_overlap(&Bitmap::from_mask(&mask.image), &sure(hints, size)?) < UNSURE {
        mask.warnings.push(UNCLEAR_TURN.to_owned());
    }
    if !turn.moves() {
        mask.warnings.push(NOTHING_MOVES.to_owned());
    }
    Ok(mask)
}

/// The pixels that hints decide.
fn sure(hints: &Hints, size: (u32, u32)) -> Result<Bitmap, MaskError> {
    let labels = Trimap::new(hints, size)?.labels;
    Ok(Bitmap::new(
        size,
        labels.iter().map(|label| label.is_sure()),
    ))
}

/// The part of the rectangle that is inside the frame.
fn used_rect(hints: &Hints, (width, height): (u32, u32)) -> Option<Rect> {
    hints.rect.and_then(|rect| rect.clipped_to(width, height))
}

/// Whether a frame of `size` can be cut by these hints, before another engine does it.
///
/// # Errors
/// As [`segment`], but for those of its result.
pub fn check_hints(hints: &Hints, size: (u32, u32)) -> Result<(), MaskError> {
    check_size(size)?;
    initial(hints, size).map(drop)
}

/// The mask of what another engine cut out of a frame by these hints (object from 128 on), with the same clean-up
/// and warnings as our own.
///
/// # Errors
/// [`MaskError::Empty`], [`MaskError::Everything`].
pub fn clean_cut(
    cut: &GrayImage,
    hints: &Hints,
    settings: &SegmentSettings,
) -> Result<Mask, MaskError> {
    let size = cut.dimensions();
    let raw = Bitmap::from_mask(cut);
    let rect = used_rect(hints, size);
    finish(&raw, size, hints, rect, settings, FILLED_OF_FRAME)
}

/// The labels of a frame by hints alone, which have to say where the object may be.
fn initial(hints: &Hints, size: (u32, u32)) -> Result<Trimap, MaskError> {
    let initial = Trimap::new(hints, size)?;
    // Marks of the background alone cut nothing out of a frame; a turn may do without those of the object.
    if initial.labels.iter().any(|label| label.is_object()) {
        Ok(initial)
    } else {
        Err(MaskError::Hints(
            "no hint says where the object is: give a rectangle, or seeds with some of the object painted white".to_owned(),
        ))
    }
}

/// The cut by hints alone.
fn cut_by_hints(
    frame: &RgbImage,
    hints: &Hints,
    settings: &SegmentSettings,
    effort: Effort,
) -> Result<Mask, MaskError> {
    let size = frame.dimensions();
    check_size(size)?;
    let Trimap {
        labels,
        first,
        rect,
    } = initial(hints, size)?;
    let pyramid = Pyramid::new(frame, labels)?;
    let known = pyramid.coarsest().labels.clone();
    let odds = by_hints::odds(&pyramid, rect);
    let start = by_hints::start(&known, first, &odds);
    let has_marks = hints.seeds.is_some() || !hints.strokes.is_empty();
    let mut pyramid = pyramid.with_evidence(by_hints::evidence(&odds, has_marks));
    let near = rect.map(surroundings);
    let mut cut = match pyramid.cut(start, first, near) {
        // Where the network says nothing, or that there is nothing else, the colours decide.
        Err(MaskError::Empty | MaskError::Everything) => {
            pyramid = pyramid.with_evidence(Vec::new());
            let first = rect.map_or(first, |_| InitialModels::Ranked(FREE_OF_RECT));
            pyramid.cut(known.clone(), first, near)
        }
        cut => cut,
    }?;
    let mut goes_on = None;
    if let (Some(rect), Some(near), None) = (rect, near, &hints.seeds)
        && let Some((longer, sides)) = beyond::continued(&pyramid, &cut, rect, near)
    {
        (cut, goes_on) = (longer, Some(sides));
    }
    let cleaned = cleanup::clean(&cut.object, &[], settings.keep_all, FILLED_OF_FRAME).mask;
    let is_unclear =
        !odds.is_empty() && by_hints::expected_overlap(&cleaned, &known, &odds) < UNSURE_BY_HINTS;
    let raw = pyramid.refined(cut, effort);
    let mut mask = finish(&raw, size, hints, rect, settings, FILLED_OF_FRAME)?;
    if is_unclear {
        mask.warnings.push(UNCLEAR_PICTURE.to_owned());
    }
    mask.warnings.extend(goes_on.map(|sides| cut_off(&sides)));
    Ok(mask)
}

/// A rectangle with what is near it.
fn surroundings(rect: Rect) -> Rect {
    rect.grown((f64::from(rect.w.max(rect.h)) * NEAR) as u32)
}

/// Why the turn's mask is worse than that of the hints alone; none if it is not.
fn misled(turn: &TurnStatistics, by_turn: &Bitmap, by_hints: &Mask) -> Option<String> {
    let by_hints = Bitmap::from_mask(&by_hints.image);
    let (of_turn, of_hints) = (turn.outline(by_turn), turn.outline(&by_hints));
    (of_turn < MIN_OF_HINTS * of_hints).then(|| {
        format!(
            "its outline follows what moves less well ({of_turn:.2}) than that of the hints alone ({of_hints:.2})"
        )
    })
}

/// The mask of a cut, cleaned up, with its warnings.
fn finish(
    raw: &Bitmap,
    size: (u32, u32),
    hints: &Hints,
    rect: Option<Rect>,
    settings: &SegmentSettings,
    fill_to: f64,
) -> Result<Mask, MaskError> {
    match raw.count() {
        0 => return Err(MaskError::Empty),
        all if all == raw.bits().len() as u64 => return Err(MaskError::Everything),
        _ => {}
    }
    let cleaned = cleanup::clean(raw, hints.marks(), settings.keep_all, fill_to);
    let levels = cleaned.mask.bits().iter().map(|&bit| u8::from(bit) * 255);
    let area_px = cleaned.mask.count();
    Ok(Mask {
        image: GrayImage::from_raw(size.0, size.1, levels.collect()).unwrap_or_default(),
        statistics: MaskStatistics {
            area_px,
            bounding_box: cleaned.mask.bounds(),
            components: cleaned.components,
            components_kept: cleaned.kept,
            holes_filled_px: cleaned.holes.iter().map(|hole| hole.area).sum(),
        },
        names_hole: filled(&cleaned, area_px as f64).is_some(),
        warnings: warnings(hints, rect, &cleaned, size),
    })
}

pub(crate) fn check_size((width, height): (u32, u32)) -> Result<(), MaskError> {
    let pixels = u64::from(width) * u64::from(height);
    if width.min(height) >= MIN_SIDE && pixels <= MAX_PIXELS {
        Ok(())
    } else {
        Err(MaskError::FrameSize { width, height })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_far_from_the_rectangle_may_have_the_colour_of_the_object() {
        let inside = |x: u32, y: u32| (30..60).contains(&x) && (30..60).contains(&y);
        let frame = RgbImage::from_fn(300, 90, |x, y| {
            let grain = ((x * 7 + y * 13) % 11) as u8;
            image::Rgb(if inside(x, y) || x > 120 {
                [150 + grain, 70, 40]
            } else {
                [130 + grain, 80, 40]
            })
        });
        let hints = Hints::from(Rect::new(20, 20, 50, 50));
        let mask = segment(&frame, &hints, &SegmentSettings::default()).unwrap();
        assert_eq!(mask.statistics.bounding_box, Rect::new(30, 30, 30, 30));
    }

    #[test]
    fn a_rectangle_that_leaves_hardly_any_background_is_cut_by_colours() {
        let inside = |x: u32, y: u32| (x as f64 - 320.0).hypot(y as f64 - 240.0) < 150.0;
        let frame = RgbImage::from_fn(640, 480, |x, y| {
            let grain = ((x * 7 + y * 13) % 11) as u8;
            image::Rgb(if inside(x, y) {
                [190 + grain, 70, 40]
            } else {
                [40 + grain, 80, 90]
            })
        });
        let hints = Hints::from(Rect::new(1, 1, 638, 478));
        let mask = segment(&frame, &hints, &SegmentSettings::default()).unwrap();
        let bounds = mask.statistics.bounding_box;
        assert!(
            (298..304).contains(&bounds.w) && (298..304).contains(&bounds.h),
            "{bounds}"
        );
    }

    #[test]
    fn a_cut_of_nothing_or_of_everything_is_no_mask() {
        let hints = Hints::from(Rect::new(4, 4, 8, 8));
        let finished = |level: u8| {
            let cut = GrayImage::from_pixel(16, 16, image::Luma([level]));
            clean_cut(&cut, &hints, &SegmentSettings::default())
        };
        assert!(matches!(finished(0), Err(MaskError::Empty)));
        assert!(matches!(finished(255), Err(MaskError::Everything)));
    }

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
        let hole = newly_enclosed(&before, &after);
        assert_eq!(hole.map(|hole| hole.area), Some(9));
        let arm = before.map(|at, bit| {
            let (x, y) = (at % 13, at / 13);
            bit || (8..12).contains(&x) && (2..5).contains(&y)
        });
        assert_eq!(newly_enclosed(&before, &arm), None);
    }
}
