//! Hints as they are given: a rectangle, painted seeds, and strokes over both.

use relit_data::geometry::Rect;

use super::{Hints, MaskError, Seeds, Strokes};

/// What a person gave to find the object by; may be empty where a turn is enough.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Drawing {
    /// The rectangle.
    pub rect: Option<Rect>,
    /// Seeds that were painted elsewhere.
    pub seeds: Option<Seeds>,
    /// What was painted over them.
    pub strokes: Strokes,
}

impl Drawing {
    /// True if nothing is given.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rect.is_none() && self.seeds.is_none() && self.strokes.is_empty()
    }

    /// The hints for a frame of `size`, none if there are none. Beside a turn, marks of the background
    /// alone are enough.
    ///
    /// # Errors
    /// [`MaskError::NothingMarked`] for marks without rectangle and turn that mark no object; as
    /// [`Strokes::paint`].
    pub fn hints(&self, size: (u32, u32), beside_turn: bool) -> Result<Option<Hints>, MaskError> {
        let seeds = match self.strokes.is_empty() {
            true => self.seeds.clone(),
            false => self.strokes.paint(size, self.seeds.as_ref())?,
        };
        match (self.rect, seeds) {
            (None, None) => Ok(None),
            (None, Some(seeds)) if beside_turn => Ok(Some(Hints::Seeds(seeds))),
            (rect, seeds) => Hints::from_parts(rect, seeds).map(Some),
        }
    }
}

impl From<Hints> for Drawing {
    fn from(hints: Hints) -> Self {
        let (rect, seeds) = match hints {
            Hints::Rect(rect) => (Some(rect), None),
            Hints::Seeds(seeds) => (None, Some(seeds)),
            Hints::Both { rect, seeds } => (Some(rect), Some(seeds)),
        };
        Self {
            rect,
            seeds,
            strokes: Strokes::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Brush, Stroke};

    #[test]
    fn background_marks_alone_are_enough_only_beside_a_turn() {
        let stroke = Stroke {
            brush: Brush::Background,
            radius: 2.0,
            points: vec![[3.0, 3.0]],
        };
        let drawing = Drawing {
            strokes: Strokes::new(vec![stroke]).unwrap(),
            ..Drawing::default()
        };
        let alone = drawing.hints((16, 16), false);
        assert!(matches!(alone, Err(MaskError::NothingMarked)));
        let beside = drawing.hints((16, 16), true).unwrap();
        assert!(matches!(beside, Some(Hints::Seeds(_))));
    }
}
