//! The regions as marks in the size of the frame, to the pixel where the edge is one between two known colours.

use image::RgbImage;

use super::nearest::nearest;
use super::regions::Regions;
use super::surface::Colour;
use crate::bitmap::Bitmap;
use crate::{Mark, MaskError, Seeds};

/// Half-width of the band along the edge that is left to the cut, pixels of the small size.
const BAND: usize = 2;
/// A pixel that is covered by the object up to this part is background. Slightly less than half: the cut prefers short
/// edges to exact ones.
const COVERED: f32 = 0.45;
/// A pixel is a mixture of two colours if it is not farther from the line between them than this part of its length, and
/// [`NOISE`].
const MIXTURE: f32 = 0.25;
/// Allowed noise of a mixture, 8-bit values.
const NOISE: f32 = 3.0;
/// Where shadow-like pixels are a smaller share of the object, they may be a shadow at its foot, and are left to the cut.
const SHADOW_AT_FOOT: f64 = 0.6;
/// Where they are a larger share, the object has the background's colour, and its shadow cannot be distinguished from it.
const MAX_SHADOW_LIKE: f64 = 0.8;
/// Fewer marked pixels of the object do not show its colours.
const MIN_OBJECT: u64 = 10;

/// The marks of object and background.
///
/// # Errors
/// [`MaskError::NotPlain`] if hardly anything is surely object.
pub(super) fn seeds(frame: &RgbImage, regions: &Regions) -> Result<Seeds, MaskError> {
    let object = sure_object(regions)?;
    let background = eroded(&regions.background);
    let nothing = || MaskError::NotPlain {
        why: "hardly anything differs from it",
    };
    if object.count() < MIN_OBJECT {
        return Err(nothing());
    }
    let edge = Edge {
        regions,
        near_object: nearest(&object).ok_or_else(nothing)?,
        near_background: nearest(&background).ok_or_else(nothing)?,
    };
    let size = frame.dimensions();
    let marks = frame.pixels().enumerate().map(|(at, pixel)| {
        let small = small_place(at, size, regions.size);
        if object.bits()[small] {
            Mark::Object
        } else if background.bits()[small] || edge.is_background(small, pixel.0.map(f32::from)) {
            Mark::Background
        } else {
            Mark::Unknown
        }
    });
    Seeds::new(size, marks.collect(), 0)
}

/// What is object without doubt: away from the edge, unlike the background, and unlike a shadow on it.
fn sure_object(regions: &Regions) -> Result<Bitmap, MaskError> {
    let sure = eroded(&regions.object).minus(&regions.alike);
    let share = sure.share_in(&regions.shadow_like);
    if share > MAX_SHADOW_LIKE {
        return Err(MaskError::NotPlain {
            why: "the object has the same colour, so that its shadow looks like it",
        });
    }
    Ok(if share < SHADOW_AT_FOOT {
        sure.minus(&regions.shadow_like)
    } else {
        sure
    })
}

fn eroded(region: &Bitmap) -> Bitmap {
    region.inverted().dilated(BAND).inverted()
}

/// The nearest sure pixels of each pixel.
struct Edge<'a> {
    regions: &'a Regions,
    near_object: Vec<usize>,
    near_background: Vec<usize>,
}

impl Edge<'_> {
    /// Whether a pixel has the colour of the background near it, or is a mixture with less than half of the object's.
    fn is_background(&self, small: usize, colour: Colour) -> bool {
        let colours = &self.regions.colours;
        let ground = colours[self.near_background[small]];
        let object = colours[self.near_object[small]];
        let between = minus(object, ground);
        let here = minus(colour, ground);
        let length = dot(between, between).max(1e-3);
        let covered = dot(here, between) / length;
        let off = (dot(here, here) - covered * covered * length)
            .max(0.0)
            .sqrt();
        let is_mixture = off < MIXTURE * length.sqrt() + NOISE;
        (covered < COVERED && is_mixture) || dot(here, here).sqrt() < self.regions.tolerance
    }
}

fn minus(a: Colour, b: Colour) -> Colour {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: Colour, b: Colour) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// A region of the small size in the size of the frame.
pub(super) fn enlarged(region: &Bitmap, small: (usize, usize), size: (u32, u32)) -> Bitmap {
    let pixels = size.0 as usize * size.1 as usize;
    let bit = |at| region.bits()[small_place(at, size, small)];
    Bitmap::new(size, (0..pixels).map(bit))
}

/// The pixel of the small size that a pixel of the frame is in.
fn small_place(at: usize, (width, height): (u32, u32), small: (usize, usize)) -> usize {
    let (width, height) = (width as usize, height as usize);
    let (x, y) = (at % width, at / width);
    y * small.1 / height * small.0 + x * small.0 / width
}
