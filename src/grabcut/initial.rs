//! From hints to what is known of each pixel before the cut.

use relit_data::geometry::Rect;

use super::grab_cut::Label;
use super::pyramid::FirstModels;
use super::{Hints, Mark, MaskError};

/// Share of a rectangle that is taken for background at first: a person leaves about half free.
const SHARE_OF_RECT: f64 = 0.5;

/// The labels with which the cut starts.
#[derive(Debug)]
pub(super) struct InitialLabels {
    pub(super) labels: Vec<Label>,
    pub(super) first: FirstModels,
    /// The part of the hinted rectangle that is inside the frame.
    pub(super) rect: Option<Rect>,
}

impl InitialLabels {
    /// The labels that the hints give to a frame of `size`.
    pub(super) fn new(hints: &Hints, size: (u32, u32)) -> Result<Self, MaskError> {
        let rect = hints.rect().map(|rect| clip(rect, size)).transpose()?;
        let seeds = hints.seeds();
        if let Some(seeds) = seeds.filter(|seeds| seeds.size() != size) {
            return Err(MaskError::SeedsSize {
                seeds: seeds.size(),
                frame: size,
            });
        }
        let marks = seeds.map_or(&[][..], |seeds| seeds.marks());
        let unmarked = |at: usize| match rect {
            None => Label::ProbablyBackground,
            Some(rect) if contains(rect, at, size.0) => Label::ProbablyObject,
            Some(_) => Label::Background,
        };
        let label = |at: usize| match marks.get(at) {
            Some(Mark::Object) => Label::Object,
            Some(Mark::Background) => Label::Background,
            Some(Mark::Unknown) | None => unmarked(at),
        };
        let pixels = size.0 as usize * size.1 as usize;
        let first = match rect {
            Some(_) => FirstModels::Ranked(SHARE_OF_RECT),
            None if marks.contains(&Mark::Background) => FirstModels::Sure,
            None => FirstModels::All,
        };
        let initial = Self {
            labels: (0..pixels).map(label).collect(),
            first,
            rect,
        };
        initial.check(hints, size)?;
        Ok(initial)
    }

    fn check(&self, hints: &Hints, (width, height): (u32, u32)) -> Result<(), MaskError> {
        let object = self.labels.iter().filter(|label| label.is_object());
        let object = object.count();
        if object == self.labels.len() {
            return Err(MaskError::NoBackground { width, height });
        }
        match hints.rect() {
            Some(rect) if object == 0 => Err(MaskError::NoObject { rect }),
            _ => Ok(()),
        }
    }
}

fn clip(rect: Rect, (width, height): (u32, u32)) -> Result<Rect, MaskError> {
    let outside = MaskError::RectOutside {
        rect,
        width,
        height,
    };
    rect.clipped_to(width, height).ok_or(outside)
}

fn contains(rect: Rect, at: usize, width: u32) -> bool {
    let (x, y) = ((at % width as usize) as i64, (at / width as usize) as i64);
    (i64::from(rect.x)..rect.right()).contains(&x)
        && (i64::from(rect.y)..rect.bottom()).contains(&y)
}
