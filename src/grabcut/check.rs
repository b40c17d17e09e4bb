//! Whether a mask fits a turn: how far the object lies beside it in each frame, and where its shape differs
//! from what the turn shows.
//!
//! The object's place in a frame is found by the directions of the brightness's gradients inside the
//! mask, compared with the average over the turn: paint and relief stay, light does not. The mask that the turn
//! alone gives ([`segment_turn`](crate::segment_turn)) shows where to look; what the curves of brightness there show
//! decides.

use std::sync::OnceLock;

use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;
use serde::Serialize;

use super::bitmap::{Bitmap, Component, Connectivity};
use super::parts::holes;
use super::pyramid::half_image;
use super::registration::Reference;
use super::turn::TurnField;
use super::{Effort, MaskError, SegmentSettings, TurnStatistics, segment_with};

/// Pixels at or above this level belong to the mask.
const INSIDE_FROM: u8 = 128;
/// Narrower differences of the shape are differences of the edge, pixels of the turn's statistics.
const NARROW: usize = 2;
/// Smaller differences of the shape, as a share of the mask's area, are not regions.
const SMALL: f64 = 0.001;
/// A part of the mask of which more than this share is table is no object that the frame's border cuts off.
const ON_TABLE: f64 = 0.5;
/// Most places of the outline at which distances are measured.
const MOST_PLACES: usize = 2000;

/// A frame registered against the average over the turn: where the object is in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Registration {
    /// From the average over the turn: right and down, pixels of the frame.
    pub shift: [f32; 2],
    /// How alike the frame and the average are there, -1..=1.
    pub likeness: f32,
}

/// A part of the image in which mask and turn differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct DoubtfulRegion {
    /// Its area, pixels.
    pub px: u64,
    /// The smallest rectangle around it.
    pub bounds: Rect,
}

/// A mask's shape against that which the turn alone shows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ShapeCheck {
    /// Pixels of the mask.
    pub area_px: u64,
    /// How well the mask's outline follows what moves differently, 0..=1.
    pub outline: f32,
    /// The same of the turn's own outline.
    pub outline_of_turn: f32,
    /// Whether the turn shows the mask to be right wherever its own differs: its outline is no measure then.
    pub contradicted: bool,
    /// Intersection over union of both.
    pub iou: f64,
    /// Distance of the mask's outline from the turn's, pixels: the median, and what 95 % stay below.
    pub edge_px: [f32; 2],
    /// Parts of the mask that show the background, largest first.
    pub leaks: Vec<DoubtfulRegion>,
    /// Parts outside the mask that show the object, largest first.
    pub missing: Vec<DoubtfulRegion>,
    /// Holes in the mask that show the object, largest first.
    pub holes: Vec<DoubtfulRegion>,
}

impl ShapeCheck {
    /// The same in pixels of frames that are `by` times as wide and high as those that were compared.
    #[must_use]
    pub fn enlarged(mut self, by: u32) -> Self {
        let area = u64::from(by) * u64::from(by);
        self.area_px *= area;
        self.edge_px = self.edge_px.map(|distance| distance * by as f32);
        let Self {
            leaks,
            missing,
            holes,
            ..
        } = &mut self;
        for region in [leaks, missing, holes].into_iter().flatten() {
            let Rect { x, y, w, h } = region.bounds;
            let signed = i32::try_from(by).unwrap_or(i32::MAX);
            region.px *= area;
            region.bounds = Rect::new(
                x.saturating_mul(signed),
                y.saturating_mul(signed),
                w.saturating_mul(by),
                h.saturating_mul(by),
            );
        }
        self
    }
}

/// A mask that is held against the frames of a turn.
#[derive(Debug)]
pub struct MaskCheck<'a> {
    turn: &'a TurnStatistics,
    mask: Bitmap,
    size: (u32, u32),
    /// Made when a frame is registered.
    reference: OnceLock<Reference>,
}

impl<'a> MaskCheck<'a> {
    /// Takes a mask (object from 128 on) and what the turn shows; both of frames of the same size.
    ///
    /// # Errors
    /// [`MaskError::FewFrames`]; [`MaskError::SeedsSize`] if the sizes differ; [`MaskError::Empty`].
    pub fn new(mask: &GrayImage, turn: &'a TurnStatistics) -> Result<Self, MaskError> {
        let size = mask.dimensions();
        turn.check()?;
        if size != turn.frame_size() {
            return Err(MaskError::SeedsSize {
                seeds: size,
                frame: turn.frame_size(),
            });
        }
        let mask = Bitmap::new(size, mask.as_raw().iter().map(|&v| v >= INSIDE_FROM));
        if mask.count() == 0 {
            return Err(MaskError::Empty);
        }
        Ok(Self {
            turn,
            mask,
            size,
            reference: OnceLock::new(),
        })
    }

    /// Where the object is in a frame of the turn; none where nothing can be told, as in a frame that is
    /// dark or of another size.
    #[must_use]
    pub fn register(&self, frame: &RgbImage) -> Option<Registration> {
        if frame.dimensions() != self.size {
            return None;
        }
        let mut small = None;
        for _ in 1..=self.turn.factor().trailing_zeros() {
            small = Some(half_image(small.as_ref().unwrap_or(frame)));
        }
        let picture = small.as_ref().unwrap_or(frame);
        let light: Vec<f32> = picture.pixels().map(|pixel| luma(pixel.0)).collect();
        let turn = self.turn;
        let reference = self
            .reference
            .get_or_init(|| Reference::new(&turn.light(), &turn.reduced(&self.mask), turn.size()));
        let (shift, likeness) = reference.find(&light)?;
        let factor = self.turn.factor() as f32;
        Some(Registration {
            shift: shift.map(|way| way * factor),
            likeness,
        })
    }

    /// Compares the mask's shape with that which the turn shows on `frame`, the one on which the mask was
    /// made, with this effort. None where the turn says nothing: hardly anything moves, or what it shows
    /// alone is no object.
    ///
    /// # Errors
    /// As [`segment_turn`](crate::segment_turn) without hints.
    pub fn shape(&self, frame: &RgbImage, effort: Effort) -> Result<Option<ShapeCheck>, MaskError> {
        if !self.turn.moves() {
            return Ok(None);
        }
        let settings = SegmentSettings::default();
        let own = match segment_with(frame, Some(self.turn), None, &settings, effort) {
            Err(MaskError::Empty | MaskError::Everything | MaskError::FrameTooSmall { .. }) => {
                return Ok(None);
            }
            own => own?,
        };
        let own = own
            .image()
            .as_raw()
            .iter()
            .map(|&level| level >= INSIDE_FROM);
        let own = Bitmap::new(self.size, own);
        let pairs = || self.mask.bits().iter().zip(own.bits());
        let both = pairs().filter(|(mask, own)| **mask && **own).count() as f64;
        let either = pairs().filter(|(mask, own)| **mask || **own).count() as f64;
        let in_hole = holes(&self.mask);
        let wide = NARROW * self.turn.factor();
        let differs = |part: Bitmap| opened(&part, wide);
        let leaks = differs(self.mask.map(|at, bit| bit && !own.bits()[at]));
        let leaks = self.without_cut_off(leaks);
        let missing = differs(
            self.mask
                .map(|at, bit| !bit && own.bits()[at] && !in_hole.bits()[at]),
        );
        let differing = leaks.count() + missing.count();
        // The curves compare a part with the rest of the mask, which is no witness where it is the smaller one.
        let witnessed = 2 * leaks.count() < self.mask.count();
        let undecided = self.shown(&leaks, |turn, part, mask| {
            turn.is_background(part, mask).is_none()
        });
        let leaks = self.shown(&leaks, |turn, part, mask| {
            turn.is_background(part, mask) == Some(true)
        });
        let missing = self.shown(&missing, TurnField::belongs);
        // Whatever the turn's own mask says of a hole, the picture in it decides.
        let filled = self.shown(&differs(in_hole), |turn, part, mask| {
            turn.is_background(part, mask) == Some(false)
        });
        Ok(Some(ShapeCheck {
            area_px: self.mask.count(),
            outline: self.turn.outline(&self.mask),
            outline_of_turn: self.turn.outline(&own),
            contradicted: witnessed
                && differing > 0
                && leaks.count() + missing.count() + undecided.count() == 0,
            iou: both / either.max(1.0),
            edge_px: distances(&self.mask, &own, self.size),
            leaks: self.regions(&leaks),
            missing: self.regions(&missing),
            holes: self.regions(&filled),
        }))
    }
}

impl MaskCheck<'_> {
    /// Of parts in which the mask may be wrong, those of which the turn shows that they are background, or object. The
    /// turn's own mask has no say.
    fn shown(&self, parts: &Bitmap, says: impl Fn(&TurnField, &Bitmap, &Bitmap) -> bool) -> Bitmap {
        let components = parts.components(Connectivity::Eight);
        let object = self.turn.reduced(&self.mask);
        let least = self.mask.count() as f64 * SMALL;
        let is_shown = |(index, component): (usize, &Component)| {
            if (component.area as f64) < least {
                return false;
            }
            let part = parts.map(|at, _| components.at(at) == Some(index));
            let part = self.turn.reduced(&part);
            says(self.turn.field(), &part, &object)
        };
        let shown: Vec<bool> = components.list.iter().enumerate().map(is_shown).collect();
        parts.map(|at, bit| bit && components.at(at).is_some_and(|index| shown[index]))
    }

    fn regions(&self, part: &Bitmap) -> Vec<DoubtfulRegion> {
        regions(part, self.mask.count() as f64 * SMALL)
    }

    /// What the turn takes for background in the mask, without the parts at the frame's border that are the object:
    /// of an object that the border cuts off, the turn says nothing, because it takes the border for background.
    /// Such a part is the object's if it moves with the rest of the mask rather than with what is around, and is not
    /// table.
    fn without_cut_off(&self, leaks: Bitmap) -> Bitmap {
        let components = leaks.components(Connectivity::Eight);
        let at_border = |bounds: &Rect| {
            let (width, height) = (i64::from(self.size.0), i64::from(self.size.1));
            bounds.x == 0 || bounds.y == 0 || bounds.right() == width || bounds.bottom() == height
        };
        let turn = self.turn;
        let is_cut_off = |(index, component): (usize, &Component)| {
            if !at_border(&component.bounds) {
                return false;
            }
            let part = turn.reduced(&leaks.map(|at, _| components.at(at) == Some(index)));
            let rest = turn.reduced(&self.mask);
            let around = rest.inverted();
            let rest = rest.map(|at, bit| bit && !part.bits()[at]);
            let within = turn.boundary(&part, &rest);
            let moves_with_rest = within.zip(turn.boundary(&part, &around));
            moves_with_rest.is_some_and(|(within, outside)| within <= outside)
                && turn.share_of_table(&part) <= ON_TABLE
        };
        let is_object: Vec<bool> = components.list.iter().enumerate().map(is_cut_off).collect();
        leaks.map(|at, bit| bit && !components.at(at).is_some_and(|index| is_object[index]))
    }
}

fn luma([r, g, b]: [u8; 3]) -> f32 {
    0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)
}

/// The parts that are wider than twice `radius`.
fn opened(part: &Bitmap, radius: usize) -> Bitmap {
    let inner = part.inverted().dilated(radius).inverted();
    let wide = inner.dilated(radius);
    part.map(|at, bit| bit && wide.bits()[at])
}

fn regions(part: &Bitmap, least: f64) -> Vec<DoubtfulRegion> {
    let components = part.components(Connectivity::Eight).list;
    let mut regions: Vec<DoubtfulRegion> = components
        .into_iter()
        .map(|Component { area, bounds }| DoubtfulRegion { px: area, bounds })
        .filter(|region| region.px as f64 >= least)
        .collect();
    regions.sort_by_key(|region| std::cmp::Reverse(region.px));
    regions
}

/// The distances of one outline's places from the other: the median and the 95th percentile.
fn distances(from: &Bitmap, to: &Bitmap, size: (u32, u32)) -> [f32; 2] {
    let (from, to) = (places(from, size), places(to, size));
    let nearest = |&[x, y]: &[f32; 2]| {
        let squares = to
            .iter()
            .map(|[a, b]| (a - x) * (a - x) + (b - y) * (b - y));
        squares.fold(f32::INFINITY, f32::min).sqrt()
    };
    let mut distances: Vec<f32> = from.iter().map(nearest).collect();
    distances.sort_by(f32::total_cmp);
    let at = |share: f64| {
        let place = (distances.len() as f64 * share) as usize;
        distances.get(place).copied().unwrap_or(0.0)
    };
    [at(0.5), at(0.95)]
}

/// Pixels of the outline, thinned out evenly.
fn places(object: &Bitmap, (width, _): (u32, u32)) -> Vec<[f32; 2]> {
    let ground = object.inverted().dilated(1);
    let edge = object.bits().iter().zip(ground.bits()).enumerate();
    let edge: Vec<usize> = edge
        .filter(|(_, (o, g))| **o && **g)
        .map(|(at, _)| at)
        .collect();
    let step = edge.len().div_ceil(MOST_PLACES).max(1);
    let width = width as usize;
    let place = |&at: &usize| [(at % width) as f32, (at / width) as f32];
    edge.iter().step_by(step).map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn narrow_differences_are_no_regions_and_larger_ones_come_first() {
        let rows = [
            "#.........", //
            "#..###....",
            "#..###....",
            "#..###....",
            "#.........",
            "#..####...",
            "#..####...",
            "#..####...",
            "#.........",
        ];
        let part = opened(&Bitmap::drawn(&rows), 1);
        let found = regions(&part, 1.0);
        let px: Vec<u64> = found.iter().map(|region| region.px).collect();
        assert_eq!(px, [12, 9]);
        assert_eq!(found[0].bounds, Rect::new(3, 5, 4, 3));
    }

    #[test]
    fn a_check_of_smaller_frames_tells_pixels_of_the_larger_ones() {
        let region = DoubtfulRegion {
            px: 3,
            bounds: Rect::new(1, 2, 3, 1),
        };
        let small = ShapeCheck {
            area_px: 50,
            outline: 0.5,
            outline_of_turn: 0.6,
            contradicted: false,
            iou: 0.8,
            edge_px: [0.5, 2.0],
            leaks: vec![region],
            missing: Vec::new(),
            holes: vec![region],
        };
        let large = small.clone().enlarged(4);
        assert_eq!((large.area_px, large.edge_px), (800, [2.0, 8.0]));
        assert_eq!(large.leaks[0].px, 48);
        assert_eq!(large.holes[0].bounds, Rect::new(4, 8, 12, 4));
        assert_eq!(small.clone().enlarged(1), small);
    }

    #[test]
    fn outlines_are_measured_apart() {
        let square = |left: u32| {
            let inside = move |at: u32| {
                (left..left + 20).contains(&(at % 40)) && (5..25).contains(&(at / 40))
            };
            Bitmap::new((40, 30), (0..1200).map(inside))
        };
        assert_eq!(distances(&square(8), &square(8), (40, 30)), [0.0, 0.0]);
        let [median, most] = distances(&square(8), &square(11), (40, 30));
        assert!(median <= 3.0 && most == 3.0, "{median} {most}");
    }

    #[test]
    fn only_what_is_enclosed_is_a_hole() {
        let rows = ["#####", "#.#.#", "###.#"];
        let wanted = [".....", ".#...", "....."];
        assert_eq!(holes(&Bitmap::drawn(&rows)), Bitmap::drawn(&wanted));
    }
}
