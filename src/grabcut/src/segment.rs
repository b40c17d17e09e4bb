//! From a frame and hints to a mask.

use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;
use serde::{Deserialize, Serialize};

use super::beyond;
use super::bitmap::{Bitmap, Component, Connectivity};
use super::cut::energy::CutEnergy;
use super::cut::grab_cut::Label;
use super::cut::pyramid::{CoarseCut, InitialModels, Pyramid};
use super::hints::trimap::Trimap;
use super::settings::{MAX_PIXELS, MIN_SIDE};
use super::turn::statistics;
use super::turn::statistics::TurnStatistics;
use super::warning::{
    IMPLAUSIBLE, NOTHING_MOVES, OPENING, UNCLEAR_TURN, cut_off, filled, hole_filled, turn_dropped,
    warnings,
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
/// A cut reaches a side of the rectangle if it comes within this share of the way to the other.
const REACHES: f64 = 0.04;
/// By how much a cut has to be better than that of GrabCut's own start where that reaches all sides of the rectangle, in
/// units of the log-likelihood of a pixel.
const MARGIN: f64 = 0.2;
/// What is near a rectangle is within this share of its longer side.
const NEAR: f64 = 0.8;
/// And what is very near within this.
const VERY_NEAR: f64 = 0.2;
/// An object covers at least this share of its rectangle.
const LEAST_OF_RECT: f64 = 0.18;
/// And what is kept of a cut is at least this share of it: a cut in many small pieces is none.
const LEAST_KEPT: f64 = 0.6;
/// Of what else is tried, the share of the rectangle that is background at first.
const OTHER_SHARE: f64 = 0.25;
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
        return by_hints(frame, hints, settings, effort);
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
            let mask = by_hints(frame, hints, settings, effort)?;
            return dropped(mask, &error.to_string());
        }
    };
    let rect = used_rect(hints, size);
    if rect.is_some()
        && let Ok(other) = by_hints(frame, hints, settings, effort)
        && let Some(why) = misled(turn, &by_turn, &other)
    {
        return dropped(other, &why);
    }
    let mut mask = finish(&by_turn, size, hints, rect, settings, FILLED_OF_TURN);
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
    match raw.count() {
        0 => return Err(MaskError::Empty),
        all if all == cut.as_raw().len() as u64 => return Err(MaskError::Everything),
        _ => {}
    }
    let rect = used_rect(hints, size);
    Ok(finish(&raw, size, hints, rect, settings, FILLED_OF_FRAME))
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
fn by_hints(
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
    let (mut cut, is_plausible) = match rect {
        Some(rect) => best_cut(&pyramid, rect, first, settings)?,
        None => (
            pyramid.cut(pyramid.coarsest().labels.clone(), first, None)?,
            true,
        ),
    };
    let mut goes_on = None;
    if let Some(rect) = rect.filter(|_| hints.seeds.is_none())
        && let Some((longer, sides)) =
            beyond::continued(&pyramid, &cut, rect, surroundings(rect, NEAR))
    {
        (cut, goes_on) = (longer, Some(sides));
    }
    let raw = pyramid.refined(cut, effort);
    let mut mask = finish(&raw, size, hints, rect, settings, FILLED_OF_FRAME);
    if !is_plausible {
        mask.warnings.push(IMPLAUSIBLE.to_owned());
    }
    mask.warnings.extend(goes_on.map(|sides| cut_off(&sides)));
    Ok(mask)
}

/// A coarse cut, and how it is judged.
struct Candidate {
    cut: CoarseCut,
    /// The lower, the better.
    energy: f64,
    /// Whether it is an object by its size and its pieces.
    is_plausible: bool,
}

/// The best of the coarse cuts in a rectangle, and whether the usual starts found an object.
///
/// There are three: GrabCut's own with all of the rectangle as object, twice, and one with the share of it as background
/// that looks most like what is around it. Models learn from what is near the rectangle, in one of the first two only
/// from what is very near: that shows best what is in the rectangle, but least of all colours.
///
/// The share is right for a rectangle with much background in it, and cuts a part off an object that fills its
/// rectangle and is in places like what is around it. So the cut of the lowest energy counts. Where one of GrabCut's
/// own start reaches all four sides of its rectangle, as the object of a tight one does, others have to be better by
/// a margin. A cut whose size or pieces are not those of an object has a low energy too, because it says little: then
/// two more starts are tried.
fn best_cut(
    pyramid: &Pyramid<'_>,
    rect: Rect,
    ranked: InitialModels,
    settings: &SegmentSettings,
) -> Result<(CoarseCut, bool), MaskError> {
    let coarsest = pyramid.coarsest();
    let part = pyramid.shrunk(rect);
    let energy = CutEnergy::new(&coarsest.image, part);
    let cut = |labels: Vec<Label>, first: InitialModels, near: f64| {
        let cut = pyramid.cut(labels, first, Some(surroundings(rect, near)))?;
        let cleaned = cleanup::clean(&cut.object, &[], settings.keep_all, FILLED_OF_FRAME);
        let margin = if first == InitialModels::All && fills(cleaned.mask.bounds(), part) {
            MARGIN
        } else {
            0.0
        };
        Ok(Candidate {
            energy: energy.of(&cleaned.mask) - margin,
            is_plausible: is_plausible(&cut.object, &cleaned.mask, part),
            cut,
        })
    };
    let all = InitialModels::All;
    let usual = [(all, VERY_NEAR), (all, NEAR), (ranked, NEAR)];
    let (mut cuts, mut failed) = (Vec::new(), None);
    for (first, near) in usual {
        match cut(coarsest.labels.clone(), first, near) {
            Ok(found) => cuts.push(found),
            Err(error) => failed = failed.or(Some(error)),
        }
    }
    cuts.sort_by(|a, b| a.energy.total_cmp(&b.energy));
    let is_usual = cuts.first().is_none_or(|best| best.is_plausible);
    if !is_usual {
        let middle = in_ellipse(&coarsest.labels, part, coarsest.image.width());
        let other = InitialModels::Ranked(OTHER_SHARE);
        let more = [
            cut(coarsest.labels.clone(), other, NEAR),
            cut(middle, all, NEAR),
        ];
        cuts.extend(more.into_iter().flatten());
        cuts.sort_by(|a, b| {
            let plausible = b.is_plausible.cmp(&a.is_plausible);
            plausible.then(a.energy.total_cmp(&b.energy))
        });
    }
    let best = cuts.into_iter().next();
    let best = best.ok_or(failed.unwrap_or(MaskError::Empty))?;
    Ok((best.cut, is_usual))
}

/// A rectangle with what is around it within a share of its longer side.
fn surroundings(rect: Rect, share: f64) -> Rect {
    let around = (f64::from(rect.w.max(rect.h)) * share) as u32;
    Rect::new(
        rect.x.saturating_sub_unsigned(around),
        rect.y.saturating_sub_unsigned(around),
        rect.w.saturating_add(2 * around),
        rect.h.saturating_add(2 * around),
    )
}

/// Whether what was kept of a cut is an object by its size and its pieces.
fn is_plausible(cut: &Bitmap, kept: &Bitmap, rect: Rect) -> bool {
    let area = f64::from(rect.w) * f64::from(rect.h);
    let kept = kept.count() as f64;
    kept >= LEAST_OF_RECT * area && kept >= LEAST_KEPT * cut.count() as f64
}

/// The labels with the corners of a rectangle, outside its inscribed ellipse, as background at first.
fn in_ellipse(labels: &[Label], rect: Rect, width: u32) -> Vec<Label> {
    let from_middle = |at: u32, begin: i32, length: u32| {
        2.0 * (f64::from(at) + 0.5 - f64::from(begin)) / f64::from(length) - 1.0
    };
    let pixels = labels.iter().enumerate();
    let labels = pixels.map(|(at, &label)| {
        let (x, y) = (at as u32 % width, at as u32 / width);
        let far = from_middle(x, rect.x, rect.w).hypot(from_middle(y, rect.y, rect.h));
        match label {
            Label::ProbablyObject if far > 1.0 => Label::ProbablyBackground,
            other => other,
        }
    });
    labels.collect()
}

/// Whether a cut reaches all four sides of its rectangle.
fn fills(found: Rect, rect: Rect) -> bool {
    let (across, down) = (f64::from(rect.w) * REACHES, f64::from(rect.h) * REACHES);
    f64::from(found.x) - f64::from(rect.x) <= across
        && f64::from(found.y) - f64::from(rect.y) <= down
        && (rect.right() - found.right()) as f64 <= across
        && (rect.bottom() - found.bottom()) as f64 <= down
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

fn finish(
    raw: &Bitmap,
    size: (u32, u32),
    hints: &Hints,
    rect: Option<Rect>,
    settings: &SegmentSettings,
    fill_to: f64,
) -> Mask {
    let cleaned = cleanup::clean(raw, hints.marks(), settings.keep_all, fill_to);
    let levels = cleaned.mask.bits().iter().map(|&bit| u8::from(bit) * 255);
    let area_px = cleaned.mask.count();
    Mask {
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
    }
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
    fn a_cut_reaches_a_rectangle_or_not() {
        let rect = Rect::new(10, 10, 100, 50);
        assert!(fills(Rect::new(12, 11, 96, 48), rect));
        assert!(!fills(Rect::new(18, 11, 90, 48), rect));
        assert!(!fills(Rect::new(12, 11, 96, 40), rect));
    }

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
    fn a_start_from_the_middle_leaves_the_corners_out_and_keeps_what_is_sure() {
        let mut labels = vec![Label::ProbablyObject; 100];
        labels[0] = Label::Object;
        let found = in_ellipse(&labels, Rect::new(0, 0, 10, 10), 10);
        assert_eq!(found[0], Label::Object);
        assert_eq!(found[9], Label::ProbablyBackground);
        assert_eq!([found[44], found[4]], [Label::ProbablyObject; 2]);
    }

    #[test]
    fn a_cut_that_covers_little_of_its_rectangle_or_is_in_pieces_is_not_plausible() {
        let rect = Rect::new(0, 0, 10, 10);
        let plausible = |rows: [&str; 10]| {
            let cut = Bitmap::drawn(&rows);
            let cleaned = cleanup::clean(&cut, &[], false, 0.0);
            is_plausible(&cut, &cleaned.mask, rect)
        };
        let whole = "..######..";
        assert!(plausible([whole; 10]));
        let little = [whole, whole, "", "", "", "", "", "", "", ""];
        assert!(!plausible(little.map(|row| if row.is_empty() {
            ".........."
        } else {
            row
        })));
        let (none, pieces) = ("..........", "#.#.#.#.#.");
        assert!(plausible([
            whole, whole, whole, none, none, none, none, none, none, none
        ]));
        assert!(!plausible([
            whole, whole, whole, none, pieces, none, pieces, none, pieces, none
        ]));
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
