//! From hints to what is known of each pixel before the cut.

use relit_data::geometry::Rect;

use crate::cut::grab_cut::Label;
use crate::cut::pyramid::InitialModels;
use crate::{Hints, Mark, MaskError};

/// The labels with which cuts start.
#[derive(Debug)]
pub(crate) struct Trimap {
    pub(crate) labels: Vec<Label>,
    /// From what the first models learn.
    pub(crate) first: InitialModels,
    /// The part of the hinted rectangle that is inside the frame.
    pub(crate) rect: Option<Rect>,
}

impl Trimap {
    /// The labels that the hints give to a frame of `size`.
    pub(crate) fn new(hints: &Hints, size: (u32, u32)) -> Result<Self, MaskError> {
        let rect = hints.rect.map(|rect| clip(rect, size)).transpose()?;
        let seeds = hints.seeds.as_ref();
        if let Some(seeds) = seeds.filter(|seeds| seeds.size() != size) {
            return Err(MaskError::sizes(seeds.size(), size));
        }
        let marks = hints.marks();
        let unmarked = |at: usize| match rect {
            None => Label::ProbablyBackground,
            Some(rect) if rect.contains(at, size.0) => Label::ProbablyObject,
            Some(_) => Label::Background,
        };
        let label = |at: usize| match marks.get(at) {
            Some(Mark::Object) => Label::Object,
            Some(Mark::Background) => Label::Background,
            Some(Mark::Unknown) | None => unmarked(at),
        };
        let pixels = size.0 as usize * size.1 as usize;
        let first = match rect {
            None if marks.contains(&Mark::Background) => InitialModels::Sure,
            _ => InitialModels::All,
        };
        let initial = Self {
            labels: (0..pixels).map(label).collect(),
            first,
            rect,
        };
        let object = initial.labels.iter().filter(|label| label.is_object());
        match (object.count(), hints.rect) {
            (object, _) if object == pixels => Err(MaskError::Hints(
                "the hints leave no background in the frame: draw the rectangle smaller than the frame, or mark background black in the seeds".to_owned(),
            )),
            (0, Some(rect)) => Err(MaskError::Hints(format!(
                "the seeds leave no pixel of the rectangle {rect} that could be the object: mark some of the object white"
            ))),
            _ => Ok(initial),
        }
    }
}

fn clip(rect: Rect, (width, height): (u32, u32)) -> Result<Rect, MaskError> {
    rect.clipped_to(width, height).ok_or_else(|| {
        MaskError::Hints(format!(
            "the rectangle {rect} is outside the frame of {width} x {height} pixels: give one that contains the object"
        ))
    })
}
