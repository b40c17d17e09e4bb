//! Thin parts of a mask that show no object but what lies on both sides of them: mostly pieces of the table's rim.
//!
//! A pixel of the rim shows some of the table and some of the room, so that its course over the turn is a mixture of
//! those below and above it. A stick or a wire of the object has its own course.

use crate::bitmap::{Bitmap, Component, Connectivity};

use super::pixel_series::{PixelSeries, dot};

/// A thin part is at most twice this share of the frame's width wide.
const WIDTH: f64 = 0.004;
/// What lies beside a part is looked for within so many times that.
const REACH: usize = 3;
/// A pixel shows what lies on both sides if it differs from every mixture of them by at most this share of their light.
const DIFFERS: f32 = 0.02;
/// And by so many times the squared difference of two neighbours there: the room has structure.
const STRUCTURE: f32 = 4.0;
/// And light below this, as a mean square, is noise.
const NOISE: f32 = 1e-5;
/// A part shows what is next to it if this share of its pixels does.
const MOSTLY: f64 = 0.35;

/// The thin parts of `object` that are at least `least` pixels long and show what lies on both sides of them.
pub(crate) fn thin_parts(series: &PixelSeries, object: &Bitmap, least: usize) -> Bitmap {
    let width = series.size().0;
    let radius = ((width as f64 * WIDTH).round() as usize).max(1);
    let thin = object.minus(&object.opened(radius));
    let ground = object.inverted().eroded(1);
    let is_whisker = |part: &Component, pixels: &dyn Fn() -> Bitmap| {
        let length = part.bounds.w.max(part.bounds.h) as usize;
        if length < least {
            return false;
        }
        let pixels = pixels();
        let set = pixels.bits().iter().enumerate().filter(|(_, bit)| **bit);
        let shown = set.filter(|(at, _)| is_between(series, &ground, *at, REACH * radius));
        shown.count() as f64 >= MOSTLY * part.area as f64
    };
    thin.parts_where(Connectivity::Eight, is_whisker)
}

/// Whether a pixel shows a mixture of what lies above and below it, or left and right of it.
fn is_between(series: &PixelSeries, ground: &Bitmap, at: usize, reach: usize) -> bool {
    let (width, height) = series.size();
    let (x, y) = (at % width, at / width);
    let ground = |places: Vec<usize>| {
        let mut shown = places.into_iter().filter(|&at| ground.bits()[at]);
        let nearest = series.mean(&[shown.next()?]);
        let next = shown.next().map(|at| series.mean(&[at]));
        Some(Side::new(nearest, next))
    };
    let above = (y.saturating_sub(reach)..y)
        .rev()
        .map(|row| row * width + x);
    let below = (y + 1..(y + reach + 1).min(height)).map(|row| row * width + x);
    let left = (x.saturating_sub(reach)..x)
        .rev()
        .map(|column| y * width + column);
    let right = (x + 1..(x + reach + 1).min(width)).map(|column| y * width + column);
    let pairs = [
        (ground(above.collect()), ground(below.collect())),
        (ground(left.collect()), ground(right.collect())),
    ];
    let own = series.mean(&[at]);
    let mut pairs = pairs
        .iter()
        .filter_map(|(one, other)| Some((one.as_ref()?, other.as_ref()?)));
    pairs.any(|(one, other)| is_mixture(&own, one, other))
}

/// What is seen on one side of a pixel.
struct Side {
    course: Vec<f32>,
    /// The squared difference of two neighbours.
    structure: f32,
}

impl Side {
    fn new(nearest: Vec<f32>, next: Option<Vec<f32>>) -> Self {
        let apart = next.map(|next| difference(&nearest, &next));
        Self {
            course: nearest,
            structure: apart.map_or(0.0, |apart| dot(&apart, &apart)),
        }
    }
}

/// Whether a course is nearly a mixture of those on two sides.
fn is_mixture(own: &[f32], one: &Side, other: &Side) -> bool {
    let apart = difference(&other.course, &one.course);
    let from_one = difference(own, &one.course);
    let length = dot(&apart, &apart);
    let along = if length > 0.0 {
        (dot(&from_one, &apart) / length).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let rest: Vec<f32> = from_one
        .iter()
        .zip(&apart)
        .map(|(from, apart)| from - along * apart)
        .collect();
    let light = dot(&one.course, &one.course).max(dot(&other.course, &other.course));
    let structure = one.structure.max(other.structure);
    dot(&rest, &rest) <= DIFFERS * light + STRUCTURE * structure + NOISE * own.len() as f32
}

fn difference(a: &[f32], b: &[f32]) -> Vec<f32> {
    a.iter().zip(b).map(|(a, b)| a - b).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::{Rgb, RgbImage};

    const SIZE: (usize, usize) = (200, 60);

    fn bitmap(is_set: impl Fn(usize, usize) -> bool) -> Bitmap {
        Bitmap::new(
            (200, 60),
            (0..200 * 60).map(|at| is_set(at % 200, at / 200)),
        )
    }

    #[test]
    fn a_piece_of_the_rim_is_a_whisker_and_a_stick_of_the_object_is_none() {
        let body = |x: usize, y: usize| (80..120).contains(&x) && (10..50).contains(&y);
        let stick = |x: usize, y: usize| (120..160).contains(&x) && (20..22).contains(&y);
        let rim = |y: usize| (39..41).contains(&y);
        let frames = [(30_u8, 200_u8), (200, 60), (90, 130), (150, 20)].map(|(room, light)| {
            RgbImage::from_fn(200, 60, |x, y| {
                let (x, y) = (x as usize, y as usize);
                let table = light / 8;
                let level = match () {
                    () if body(x, y) || stick(x, y) => light,
                    () if rim(y) => room / 2 + table / 2,
                    () if y > 40 => table,
                    () => room,
                };
                Rgb([level; 3])
            })
        });
        let series = PixelSeries::new(&frames, SIZE);
        let whisker = |x: usize, y: usize| rim(y) && (40..80).contains(&x);
        let object = bitmap(|x, y| body(x, y) || stick(x, y) || whisker(x, y));
        assert_eq!(thin_parts(&series, &object, 8), bitmap(whisker));
        assert_eq!(thin_parts(&series, &object, 50).count(), 0);
    }
}
