//! Objects that go on beyond a side of their rectangle.
//!
//! What is outside the rectangle is background, also for the models: a rectangle that cuts a part of the object off
//! teaches them that its colours are background. So where a cut reaches a side of its rectangle, it is made again with
//! what is beyond that side as open as the inside. If the object goes on there, that cut counts, without what is outside.

use std::ops::Range;

use image::RgbImage;
use relit_data::geometry::Rect;

use crate::bitmap::Bitmap;
use crate::cut::grab_cut::Label;
use crate::cut::pyramid::{CoarseCut, InitialModels, Pyramid};

/// A cut reaches a side if it has this share of the pixels along it.
const REACHES: f64 = 0.04;
/// What is beyond a side is open over this share of the way to the other side.
const DEPTH: f64 = 0.25;
/// The object goes on beyond a side if at least this share of it lies there.
const GOES_ON: f64 = 0.015;

/// Another cut of the object in `rect`, and the names of the sides beyond which the object goes on; none if it does so
/// nowhere. Models learn from the pixels in `sampled`.
pub(crate) fn continued(
    pyramid: &Pyramid<'_>,
    cut: &CoarseCut,
    rect: Rect,
    sampled: Rect,
) -> Option<(CoarseCut, Vec<&'static str>)> {
    let coarsest = pyramid.coarsest();
    let sides = Side::all(pyramid.shrunk(rect), &coarsest.image);
    let reached: Vec<Side> = sides
        .into_iter()
        .filter(|side| side.has_beyond() && side.is_reached(&cut.object))
        .collect();
    if reached.is_empty() {
        return None;
    }
    let mut labels = cut.labels.clone();
    for side in &reached {
        side.open(&mut labels, &cut.object);
    }
    let all = InitialModels::All;
    let longer = pyramid.cut(labels, all, Some(sampled)).ok()?;
    let area = longer.object.count() as f64;
    let names: Vec<&str> = reached
        .iter()
        .filter(|side| side.beyond(&longer.object) as f64 >= GOES_ON * area)
        .map(|side| side.name)
        .collect();
    if names.is_empty() {
        return None;
    }
    Some((pyramid.within_known(longer).ok()?, names))
}

/// A side of a rectangle: the pixels just inside it, and of each of them those beyond, from the nearest on.
struct Side {
    name: &'static str,
    pixels: Vec<(usize, Vec<usize>)>,
}

impl Side {
    /// Of lines that cross the side, with the places on them; `at` says which pixel a place on a line is.
    fn new(
        name: &'static str,
        lines: Range<usize>,
        at: impl Fn(usize, usize) -> usize,
        inside: usize,
        beyond: Vec<usize>,
    ) -> Self {
        let pixels = lines.map(|line| {
            let beyond = beyond.iter().map(|&place| at(line, place)).collect();
            (at(line, inside), beyond)
        });
        Self {
            name,
            pixels: pixels.collect(),
        }
    }

    /// The sides of a part of an image.
    fn all(part: Rect, image: &RgbImage) -> [Self; 4] {
        let (columns, rows) = (image.width() as usize, image.height() as usize);
        let (left, top) = (part.x.max(0) as usize, part.y.max(0) as usize);
        let right = (left + part.w as usize).min(columns);
        let bottom = (top + part.h as usize).min(rows);
        let deep = |length: u32| (f64::from(length) * DEPTH) as usize;
        let (across, down) = (deep(part.w), deep(part.h));
        let row = |y: usize, x: usize| y * columns + x;
        let column = |x: usize, y: usize| y * columns + x;
        let before = |end: usize, deep: usize| (end.saturating_sub(deep)..end).rev().collect();
        let after =
            |begin: usize, deep: usize, end: usize| (begin..end.min(begin + deep)).collect();
        [
            Self::new("left", top..bottom, row, left, before(left, across)),
            Self::new(
                "right",
                top..bottom,
                row,
                right - 1,
                after(right, across, columns),
            ),
            Self::new("upper", left..right, column, top, before(top, down)),
            Self::new(
                "lower",
                left..right,
                column,
                bottom - 1,
                after(bottom, down, rows),
            ),
        ]
    }

    /// None where the side is the image's.
    fn has_beyond(&self) -> bool {
        self.pixels.iter().any(|(_, beyond)| !beyond.is_empty())
    }

    fn is_reached(&self, object: &Bitmap) -> bool {
        let along = self
            .pixels
            .iter()
            .filter(|(inside, _)| object.bits()[*inside]);
        along.count() as f64 >= REACHES * self.pixels.len() as f64
    }

    /// Makes open what is beyond: at first what the pixel just inside is.
    fn open(&self, labels: &mut [Label], object: &Bitmap) {
        for (inside, beyond) in &self.pixels {
            for &at in beyond {
                labels[at] = Label::probably(object.bits()[*inside]);
            }
        }
    }

    /// How many pixels of an object lie beyond.
    fn beyond(&self, object: &Bitmap) -> usize {
        let all = self.pixels.iter().flat_map(|(_, beyond)| beyond);
        all.filter(|&&at| object.bits()[at]).count()
    }
}
