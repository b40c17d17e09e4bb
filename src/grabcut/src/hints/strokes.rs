//! Strokes of a brush, which become seeds: what a person paints in the editor, and what `mask.json` keeps
//! of it.

use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::marks::Mark;
use crate::settings::MAX_PIXELS;
use crate::{MaskError, Seeds};

/// Coordinates and radii are smaller, pixels.
const FARTHEST: f32 = 1e5;
/// Most pixels that all strokes together touch, doubled ones counted each time.
const MAX_WORK: u64 = 1 << 31;

/// What a stroke does to the pixels that it covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Brush {
    /// Marks them as object.
    Object,
    /// Marks them as background.
    Background,
    /// Takes their marks away.
    Eraser,
}

/// A stroke of a round brush.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Stroke {
    /// What it does.
    pub brush: Brush,
    /// The brush's radius, pixels of the frame.
    pub radius: f32,
    /// The way of the brush's middle, x and y in pixels of the frame; the upper left pixel's middle
    /// is (0.5, 0.5).
    pub points: Vec<[f32; 2]>,
}

/// Strokes in the order in which they were painted; later ones cover earlier ones.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Stroke>")]
pub struct Strokes(Vec<Stroke>);

impl Strokes {
    /// Checks the strokes.
    ///
    /// # Errors
    /// [`MaskError::Hints`] with the place of a stroke that cannot be painted.
    pub fn new(strokes: Vec<Stroke>) -> Result<Self, MaskError> {
        let is_near = |value: &f32| value.abs() <= FARTHEST;
        let is_valid = |stroke: &Stroke| {
            !stroke.points.is_empty()
                && stroke.points.iter().flatten().all(is_near)
                && is_near(&stroke.radius)
                && stroke.radius > 0.0
        };
        match strokes.iter().position(|stroke| !is_valid(stroke)) {
            Some(at) => Err(MaskError::Hints(format!(
                "stroke {at} has no point, or a coordinate or radius that is out of range"
            ))),
            None => Ok(Self(strokes)),
        }
    }

    /// True without any stroke.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Number of strokes.
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The marks in a frame of `size` after painting over `base`; none if nothing is marked then.
    ///
    /// # Errors
    /// [`MaskError::Hints`] if `base` has another size, or painting would take too long; [`MaskError::FrameSize`].
    pub fn paint(
        &self,
        size: (u32, u32),
        base: Option<&Seeds>,
    ) -> Result<Option<Seeds>, MaskError> {
        let (width, height) = size;
        let pixels = u64::from(width) * u64::from(height);
        if pixels > MAX_PIXELS {
            return Err(MaskError::FrameSize { width, height });
        }
        if let Some(base) = base.filter(|base| base.size() != size) {
            return Err(MaskError::sizes(base.size(), size));
        }
        let work: u64 = self.0.iter().map(|stroke| work(stroke, size)).sum();
        if work > MAX_WORK {
            let why = "the strokes cover too many pixels: paint with fewer or smaller ones";
            return Err(MaskError::Hints(why.to_owned()));
        }
        let unmarked = || vec![Mark::Unknown; pixels as usize];
        let mut marks = base.map_or_else(unmarked, |base| base.marks().to_vec());
        for stroke in &self.0 {
            paint(&mut marks, size, stroke);
        }
        Ok(Seeds::new(size, marks, base.map_or(0, Seeds::coloured_px)).ok())
    }
}

impl TryFrom<Vec<Stroke>> for Strokes {
    type Error = MaskError;

    fn try_from(strokes: Vec<Stroke>) -> Result<Self, MaskError> {
        Self::new(strokes)
    }
}

/// The lines that a stroke consists of; one without length for a single point.
fn lines(stroke: &Stroke) -> impl Iterator<Item = [[f64; 2]; 2]> {
    let point = |at: usize| stroke.points[at.min(stroke.points.len() - 1)].map(f64::from);
    let count = stroke.points.len().saturating_sub(1).max(1);
    (0..count).map(move |at| [point(at), point(at + 1)])
}

/// The columns and rows that a brush may touch on a line.
fn around([from, to]: [[f64; 2]; 2], radius: f64, size: (u32, u32)) -> [Range<usize>; 2] {
    let covered = |axis: usize, side: u32| {
        let low = from[axis].min(to[axis]) - radius;
        let high = from[axis].max(to[axis]) + radius;
        let inside = |at: f64| at.clamp(0.0, f64::from(side)) as usize;
        inside(low.floor())..inside(high.ceil())
    };
    [covered(0, size.0), covered(1, size.1)]
}

/// The pixels that painting a stroke looks at.
fn work(stroke: &Stroke, size: (u32, u32)) -> u64 {
    let looked_at = |line| {
        let [columns, rows] = around(line, f64::from(stroke.radius), size);
        (columns.len() * rows.len()) as u64
    };
    lines(stroke).map(looked_at).sum()
}

/// Marks the pixels whose middles are within the radius of the stroke's lines.
fn paint(marks: &mut [Mark], size: (u32, u32), stroke: &Stroke) {
    let mark = match stroke.brush {
        Brush::Object => Mark::Object,
        Brush::Background => Mark::Background,
        Brush::Eraser => Mark::Unknown,
    };
    let radius = f64::from(stroke.radius);
    for [from, to] in lines(stroke) {
        let [columns, rows] = around([from, to], radius, size);
        let way = [to[0] - from[0], to[1] - from[1]];
        let length = way[0] * way[0] + way[1] * way[1];
        for y in rows {
            for x in columns.clone() {
                let at = [x as f64 + 0.5 - from[0], y as f64 + 0.5 - from[1]];
                let along = if length > 0.0 {
                    ((at[0] * way[0] + at[1] * way[1]) / length).clamp(0.0, 1.0)
                } else {
                    0.0
                };
                let off = [at[0] - along * way[0], at[1] - along * way[1]];
                if off[0] * off[0] + off[1] * off[1] <= radius * radius {
                    marks[y * size.0 as usize + x] = mark;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stroke(brush: Brush, radius: f32, points: &[[f32; 2]]) -> Stroke {
        let points = points.to_vec();
        Stroke {
            brush,
            radius,
            points,
        }
    }

    fn painted(strokes: Vec<Stroke>, base: Option<&Seeds>) -> Vec<String> {
        let strokes = Strokes::new(strokes).unwrap();
        let seeds = strokes.paint((8, 5), base).unwrap().unwrap();
        let letter = |mark: &Mark| match mark {
            Mark::Object => '#',
            Mark::Background => 'o',
            Mark::Unknown => '.',
        };
        let rows = seeds.marks().chunks(8);
        rows.map(|row| row.iter().map(letter).collect()).collect()
    }

    #[test]
    fn a_stroke_covers_what_the_brush_passes_over() {
        let strokes = vec![
            stroke(Brush::Object, 1.2, &[[2.5, 1.5], [5.5, 1.5]]),
            stroke(Brush::Background, 0.6, &[[1.5, 4.5]]),
        ];
        let wanted = ["..####..", ".######.", "..####..", "........", ".o......"];
        assert_eq!(painted(strokes, None), wanted);
    }

    #[test]
    fn later_strokes_cover_earlier_ones_and_the_eraser_uncovers() {
        let strokes = vec![
            stroke(Brush::Object, 0.6, &[[0.5, 0.5], [7.5, 0.5]]),
            stroke(Brush::Background, 0.6, &[[2.5, 0.5]]),
            stroke(Brush::Eraser, 0.6, &[[4.5, 0.5]]),
        ];
        let base = Strokes::new(vec![stroke(Brush::Object, 0.6, &[[7.5, 4.5]])]).unwrap();
        let base = base.paint((8, 5), None).unwrap();
        let wanted = ["##o#.###", "........", "........", "........", ".......#"];
        assert_eq!(painted(strokes, base.as_ref()), wanted);
    }

    #[test]
    fn strokes_outside_the_frame_mark_nothing() {
        let strokes = Strokes::new(vec![stroke(Brush::Object, 3.0, &[[-90.0, 1e5]])]).unwrap();
        assert_eq!(strokes.paint((8, 5), None).unwrap(), None);
    }

    #[test]
    fn strokes_that_are_none_are_refused() {
        let wrong = |radius, points: &[[f32; 2]]| {
            Strokes::new(vec![stroke(Brush::Object, radius, points)]).is_err()
        };
        assert!(wrong(1.0, &[]));
        assert!(wrong(0.0, &[[1.0, 1.0]]) && wrong(f32::NAN, &[[1.0, 1.0]]));
        assert!(wrong(1.0, &[[f32::INFINITY, 1.0]]) && wrong(1.0, &[[1.0, 2e5]]));
        let many = vec![stroke(Brush::Object, 9e4, &[[1.0, 1.0]; 300]); 40];
        let result = Strokes::new(many).unwrap().paint((4000, 4000), None);
        assert!(matches!(result, Err(MaskError::Hints(_))));
        let huge = Strokes::default().paint((u32::MAX, 9), None);
        assert!(matches!(huge, Err(MaskError::FrameSize { .. })));
    }
}
