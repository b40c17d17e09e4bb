//! From a frame and hints to a mask.

use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;

use super::bitmap::Bitmap;
use super::closed::enclosed;
use super::initial::InitialLabels;
use super::mask::{Mask, MaskStatistics};
use super::pyramid::FirstModels;
use super::settings::{MAX_PIXELS, MIN_SIDE};
use super::starts::{StartCuts, StartRule};
use super::turn::{self, TurnStatistics};
use super::warning::OPENING;
use super::{Effort, Hints, MaskError, SegmentSettings, Warning, cleanup, pyramid, warning};

/// On one frame a hole of this share of the object may be a highlight, and is filled.
const FILLED_OF_FRAME: f64 = 0.01;
/// The turn's outline has at least this share of the strength of the hints' one.
const LEAST_OF_HINTS: f32 = 0.85;
/// Over a turn highlights move: only specks are filled.
const FILLED_OF_TURN: f64 = 0.001;

/// Finds the object in `frame`. The same input gives the same mask.
///
/// # Errors
/// [`MaskError::FrameTooSmall`], [`MaskError::FrameTooLarge`]; hints that do not fit the frame
/// ([`MaskError::RectOutside`], [`MaskError::NoBackground`], [`MaskError::NoObject`], [`MaskError::SeedsSize`]);
/// a result without object or without background ([`MaskError::Empty`], [`MaskError::Everything`]).
pub fn segment(
    frame: &RgbImage,
    hints: &Hints,
    settings: &SegmentSettings,
) -> Result<Mask, MaskError> {
    segment_with(frame, None, Some(hints), settings, Effort::Fine)
}

/// Finds the object in `frame` by what a turn shows, with or without hints. `turn` was made from frames of
/// the same recording. The same input gives the same mask.
///
/// With a rectangle there is a guard against a turn that misleads: if its mask has an outline along which less
/// moves differently than along that of the hints alone, the hints alone decide, and a warning says so; so it is
/// with any hints if there are too few frames.
///
/// # Errors
/// [`MaskError::FewFrames`] without hints; otherwise as [`segment`].
pub fn segment_turn(
    frame: &RgbImage,
    turn: &TurnStatistics,
    hints: Option<&Hints>,
    settings: &SegmentSettings,
) -> Result<Mask, MaskError> {
    segment_with(frame, Some(turn), hints, settings, Effort::Fine)
}

/// [`segment_turn`], or [`segment`] without a turn, with more or less effort.
///
/// # Errors
/// As these; [`MaskError::NoHints`] with neither turn nor hints.
pub fn segment_with(
    frame: &RgbImage,
    turn: Option<&TurnStatistics>,
    hints: Option<&Hints>,
    settings: &SegmentSettings,
    effort: Effort,
) -> Result<Mask, MaskError> {
    let mask = cut_unclosed(frame, turn, hints, settings, effort)?;
    let told = |warning: &Warning| matches!(warning, Warning::HoleFilled { .. });
    let closed = match hints {
        Some(hints) if effort != Effort::Draft && !mask.warnings.iter().any(told) => {
            closed_opening(frame, turn, hints, settings, &mask)
        }
        _ => None,
    };
    Ok(mask.with_warning(closed))
}

/// What a mask lacks that the marks closed. It is found by a cut without the marks of the object; none where there is
/// no cut without them.
fn closed_opening(
    frame: &RgbImage,
    turn: Option<&TurnStatistics>,
    hints: &Hints,
    settings: &SegmentSettings,
    mask: &Mask,
) -> Option<Warning> {
    if !hints.seeds()?.mark_the_object() {
        return None;
    }
    let fewer = hints.without_object_marks();
    // Marks of the background alone show no object.
    let fewer = fewer.filter(|fewer| turn.is_some() || fewer.rect().is_some());
    if fewer.is_none() && turn.is_none() {
        return None;
    }
    let before = cut_unclosed(frame, turn, fewer.as_ref(), settings, Effort::Fine).ok()?;
    let hole = enclosed(&before.bitmap(), &mask.bitmap())?;
    let (px, bounds) = (hole.area, hole.bounds);
    let large = px as f64 >= OPENING * mask.statistics().area_px as f64;
    large.then_some(Warning::HoleFilled { px, bounds })
}

/// [`segment_with`] without a look at openings that the marks closed.
fn cut_unclosed(
    frame: &RgbImage,
    turn: Option<&TurnStatistics>,
    hints: Option<&Hints>,
    settings: &SegmentSettings,
    effort: Effort,
) -> Result<Mask, MaskError> {
    let Some(turn) = turn else {
        let hints = hints.ok_or(MaskError::NoHints)?;
        return by_hints(frame, hints, settings, effort);
    };
    let size = frame.dimensions();
    check_size(size)?;
    let by_turn = match turn::segment(frame, turn, hints, settings.iterations, effort) {
        Ok(by_turn) => by_turn,
        Err(error) => {
            let Some(hints) = hints else {
                return Err(error);
            };
            let why = error.to_string();
            let mask = by_hints(frame, hints, settings, effort)?;
            return Ok(mask.with_warning(Some(Warning::TurnDropped { why })));
        }
    };
    let rect = hints
        .and_then(Hints::rect)
        .and_then(|rect| rect.clipped_to(size.0, size.1));
    if let (Some(hints), Some(_)) = (hints, rect)
        && let Ok(other) = by_hints(frame, hints, settings, effort)
        && let Some(why) = misled(turn, &by_turn, &other)
    {
        return Ok(other.with_warning(Some(Warning::TurnDropped { why })));
    }
    let still = (!turn.moves()).then_some(Warning::NothingMoves);
    let mask = finish(&by_turn, size, hints, rect, settings, FILLED_OF_TURN)?;
    Ok(mask.with_warning(still))
}

/// Whether a frame of `size` can be cut by these hints, before another engine does it.
///
/// # Errors
/// As [`segment`], but for those of its result.
pub fn check_hints(hints: &Hints, size: (u32, u32)) -> Result<(), MaskError> {
    check_size(size)?;
    InitialLabels::new(hints, size).map(drop)
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
    let raw = Bitmap::new(size, cut.as_raw().iter().map(|&level| level >= 128));
    match raw.count() {
        0 => return Err(MaskError::Empty),
        all if all == cut.as_raw().len() as u64 => return Err(MaskError::Everything),
        _ => {}
    }
    let rect = hints.rect();
    let rect = rect.and_then(|rect| rect.clipped_to(size.0, size.1));
    finish(&raw, size, Some(hints), rect, settings, FILLED_OF_FRAME)
}

fn by_hints(
    frame: &RgbImage,
    hints: &Hints,
    settings: &SegmentSettings,
    effort: Effort,
) -> Result<Mask, MaskError> {
    check_size(frame.dimensions())?;
    let initial = InitialLabels::new(hints, frame.dimensions())?;
    if initial.rect.is_none() {
        let first = initial.first;
        return cut_from(frame, hints, &initial, first, settings, effort);
    }
    let rule = StartRule::default();
    cuts_by_hints(frame, hints, &initial, settings, effort, rule.shares)?.into_mask(rule)
}

/// A rectangle's cuts from several starts, each named by the share of the rectangle that is background at first, 0 to
/// 1; what [`segment`] chooses from. Seeds alone have one start, that of share 0.
///
/// # Errors
/// As [`segment`].
pub fn start_cuts(
    frame: &RgbImage,
    hints: &Hints,
    settings: &SegmentSettings,
    shares: &[f64],
) -> Result<StartCuts, MaskError> {
    check_size(frame.dimensions())?;
    let initial = InitialLabels::new(hints, frame.dimensions())?;
    cuts_by_hints(frame, hints, &initial, settings, Effort::Fine, shares)
}

fn cuts_by_hints(
    frame: &RgbImage,
    hints: &Hints,
    initial: &InitialLabels,
    settings: &SegmentSettings,
    effort: Effort,
    shares: &[f64],
) -> Result<StartCuts, MaskError> {
    let whole = Rect::new(0, 0, frame.width(), frame.height());
    let rect = initial.rect.unwrap_or(whole);
    let shares = if initial.rect.is_some() {
        shares
    } else {
        &[0.0]
    };
    StartCuts::make(frame, rect, shares, |share| {
        let first = match initial.rect {
            None => initial.first,
            Some(_) if share > 0.0 => FirstModels::Ranked(share),
            Some(_) => FirstModels::All,
        };
        cut_from(frame, hints, initial, first, settings, effort)
    })
}

fn cut_from(
    frame: &RgbImage,
    hints: &Hints,
    initial: &InitialLabels,
    first: FirstModels,
    settings: &SegmentSettings,
    effort: Effort,
) -> Result<Mask, MaskError> {
    let mut labels = initial.labels.clone();
    // Marks of the background alone cut nothing out of a frame; a turn may do without those of the object.
    if !labels.iter().any(|label| label.is_object()) {
        return Err(MaskError::NothingMarked);
    }
    pyramid::segment(frame, &mut labels, first, settings.iterations, effort)?;
    let size = frame.dimensions();
    let raw = Bitmap::new(size, labels.iter().map(|label| label.is_object()));
    finish(
        &raw,
        size,
        Some(hints),
        initial.rect,
        settings,
        FILLED_OF_FRAME,
    )
}

/// Why the turn's mask is worse than that of the hints alone; none if it is not.
fn misled(turn: &TurnStatistics, by_turn: &Bitmap, by_hints: &Mask) -> Option<String> {
    let (of_turn, of_hints) = (turn.outline(by_turn), turn.outline(&by_hints.bitmap()));
    (of_turn < LEAST_OF_HINTS * of_hints).then(|| {
        format!(
            "its outline follows what moves less well ({of_turn:.2}) than that of the hints alone ({of_hints:.2})"
        )
    })
}

fn finish(
    raw: &Bitmap,
    size: (u32, u32),
    hints: Option<&Hints>,
    rect: Option<Rect>,
    settings: &SegmentSettings,
    fill_to: f64,
) -> Result<Mask, MaskError> {
    let seeds = hints.and_then(Hints::seeds);
    let cleaned = cleanup::clean(raw, seeds, settings.keep_all, fill_to);
    Ok(Mask {
        image: cleanup::soften(&cleaned.mask, size, settings.feather),
        statistics: MaskStatistics {
            area_px: cleaned.mask.count(),
            bounding_box: cleaned.mask.bounds(),
            components: cleaned.components,
            components_kept: cleaned.kept,
            holes_filled_px: cleaned.holes.iter().map(|hole| hole.area).sum(),
        },
        warnings: warning::warnings(hints, rect, &cleaned, size),
    })
}

fn check_size((width, height): (u32, u32)) -> Result<(), MaskError> {
    if width.min(height) < MIN_SIDE {
        return Err(MaskError::FrameTooSmall { width, height });
    }
    if u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(MaskError::FrameTooLarge { width, height });
    }
    Ok(())
}
