//! Whether a mask fits a turn: where its shape differs from what the turn shows.
//!
//! The mask that the turn alone gives ([`segment_with`](crate::segment_with)) shows where to look; what the network says
//! of the pixels there decides.

use image::{GrayImage, RgbImage};
use relit_data::geometry::Rect;
use serde::Serialize;

use crate::bitmap::{Bitmap, Component, Connectivity};
use crate::turn::thin_parts::thin_parts;
use crate::{Effort, Hints, MaskError, SegmentSettings, TurnStatistics, segment_with};

/// Narrower differences of the shape are differences of the edge, pixels of the turn's statistics.
const NARROW: usize = 2;
/// Smaller differences of the shape, as a share of the mask's area, are not regions.
const SMALL: f64 = 0.001;
/// A thin part of the mask that does not belong to the object is a whisker from this length on, as a share of the
/// frame's width.
const WHISKER: f64 = 0.04;
/// That a part of the mask is background is clear from these odds on, as a logarithm.
const CLEAR: f32 = 4.5;
/// That a part outside is object, from these.
const CLEAR_OBJECT: f32 = 2.0;
/// What gives reason to look at more frames from these on.
const SUSPECT: f32 = 1.0;
/// A part of the mask with more than this share of table is not an object that the frame's border cuts off.
const ON_TABLE: f64 = 0.5;

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
    /// Whether the turn confirms the mask wherever its own differs: then its outline is not a measure.
    pub contradicted: bool,
    /// Parts of the mask that show the background, largest first.
    pub leaks: Vec<DoubtfulRegion>,
    /// Long thin parts of the mask that show what is on both sides of them, as pieces of the table's rim do, largest
    /// first.
    pub whiskers: Vec<DoubtfulRegion>,
    /// Parts outside the mask that show the object, holes too, largest first.
    pub missing: Vec<DoubtfulRegion>,
}

impl ShapeCheck {
    /// The same in pixels of frames that are `by` times as wide and high as those that were compared.
    #[must_use]
    pub fn enlarged(mut self, by: u32) -> Self {
        let area = u64::from(by) * u64::from(by);
        self.area_px *= area;
        let regions = [&mut self.leaks, &mut self.whiskers, &mut self.missing];
        for region in regions.into_iter().flatten() {
            let Rect { x, y, w, h } = region.bounds;
            let signed = i32::try_from(by).unwrap_or(i32::MAX);
            region.px *= area;
            let (x, y) = (x.saturating_mul(signed), y.saturating_mul(signed));
            region.bounds = Rect::new(x, y, w.saturating_mul(by), h.saturating_mul(by));
        }
        self
    }
}

/// A mask that is held against the frames of a turn.
#[derive(Debug)]
pub struct MaskCheck<'a> {
    turn: &'a TurnStatistics,
    mask: Bitmap,
}

impl<'a> MaskCheck<'a> {
    /// Takes a mask (object from 128 on) and what the turn shows; both of frames of the same size.
    ///
    /// # Errors
    /// [`MaskError::FewFrames`]; [`MaskError::Hints`] if the sizes differ; [`MaskError::Empty`].
    pub fn new(mask: &GrayImage, turn: &'a TurnStatistics) -> Result<Self, MaskError> {
        let size = mask.dimensions();
        turn.check()?;
        if size != turn.full {
            return Err(MaskError::sizes(size, turn.full));
        }
        let mask = Bitmap::from_mask(mask);
        if mask.count() == 0 {
            return Err(MaskError::Empty);
        }
        Ok(Self { turn, mask })
    }

    /// Compares the mask's shape with that which the turn shows on `frame`, the one on which the mask was
    /// made, with this effort. `None` if the turn says nothing: what it shows alone is not an object, or hardly
    /// anything moves and nothing wrong is found.
    ///
    /// # Errors
    /// As [`segment_with`] a turn and no hints.
    pub fn shape(&self, frame: &RgbImage, effort: Effort) -> Result<Option<ShapeCheck>, MaskError> {
        let moves = self.turn.moves();
        let (none, settings) = (Hints::default(), SegmentSettings::default());
        let own = match segment_with(frame, Some(self.turn), &none, &settings, effort) {
            Err(MaskError::Empty | MaskError::Everything | MaskError::FrameSize { .. }) => {
                return Ok(None);
            }
            own => Bitmap::from_mask(&own?.image),
        };
        let wide = NARROW * self.turn.factor();
        let leaks = self.without_cut_off(&self.mask.minus(&own).opened(wide));
        let missing = own.minus(&self.mask).opened(wide);
        let differing = leaks.count() + missing.count();
        // A mask that is mostly background is not one that the turn confirms.
        let witnessed = 2 * leaks.count() < self.mask.count();
        // A draft only has to suspect.
        let clear = if effort == Effort::Draft {
            SUSPECT
        } else {
            CLEAR
        };
        let is_background = |odds: f32| odds < -clear;
        let is_object = |odds: f32| odds > clear.min(CLEAR_OBJECT);
        let undecided = self.shown(&leaks, |odds| odds.abs() <= clear);
        let leaks = self.shown(&leaks, is_background);
        let whiskers = self.whiskers(&own);
        let missing = self.shown(&missing, is_object);
        let undisputed = leaks.count() + missing.count() + undecided.count() == 0;
        let least = self.mask.count() as f64 * SMALL;
        // Where hardly anything moves, no outline follows it.
        let outline = |mask: &Bitmap| {
            if moves { self.turn.outline(mask) } else { 0.0 }
        };
        let shape = ShapeCheck {
            area_px: self.mask.count(),
            outline: outline(&self.mask),
            outline_of_turn: outline(&own),
            contradicted: witnessed && differing > 0 && undisputed,
            leaks: regions(&leaks, least),
            whiskers: regions(&whiskers, 0.0),
            missing: regions(&missing, least),
        };
        Ok((moves || !shape.faults().is_empty()).then_some(shape))
    }

    /// Parts in which the mask may be wrong and the turn says so: `says` gets the logarithm of the odds that a part is
    /// object. The turn's own mask does not count.
    fn shown(&self, parts: &Bitmap, says: impl Fn(f32) -> bool) -> Bitmap {
        let least = self.mask.count() as f64 * SMALL;
        parts.parts_where(Connectivity::Eight, |component, part| {
            let odds = || self.turn.field.odds(&self.turn.downscaled(&part()));
            component.area as f64 >= least && says(odds())
        })
    }

    /// Thin parts of the mask that neither the turn's own has nor the object.
    fn whiskers(&self, own: &Bitmap) -> Bitmap {
        let object = self.turn.downscaled(&self.mask);
        let least = (object.width() as f64 * WHISKER).round() as usize;
        let found = thin_parts(&self.turn.series, &object, least);
        let beyond = found.minus(&self.turn.downscaled(own).dilated(1));
        let long = |part: &Component, _: &dyn Fn() -> Bitmap| {
            part.bounds.w.max(part.bounds.h) as usize >= least
        };
        let long = beyond.parts_where(Connectivity::Eight, long);
        self.upscaled(&long)
    }

    /// A part of the mask at the size of the statistics in that of the frames.
    fn upscaled(&self, part: &Bitmap) -> Bitmap {
        let (width, height) = self.turn.full;
        let size = (width as usize, height as usize);
        part.enlarged(self.turn.factor(), size).and(&self.mask)
    }

    /// What the turn takes for background in the mask, without the parts at the frame's border that are the object:
    /// of an object that the border cuts off, the turn says nothing, because it takes the border for background.
    /// Such a part is the object's if it moves with the rest of the mask rather than with what is around, and is not
    /// table.
    fn without_cut_off(&self, leaks: &Bitmap) -> Bitmap {
        let field = &self.turn.field;
        leaks.parts_where(Connectivity::Eight, |component, part| {
            if leaks.is_inside(component) {
                return true;
            }
            let (part, mask) = (
                self.turn.downscaled(&part()),
                self.turn.downscaled(&self.mask),
            );
            let within = field.boundary(&part, &mask.minus(&part));
            let moves_with_rest = within.zip(field.boundary(&part, &mask.inverted()));
            let is_object = moves_with_rest.is_some_and(|(within, outside)| within <= outside)
                && part.share_in(&field.table()) <= ON_TABLE;
            !is_object
        })
    }
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
        let part = Bitmap::drawn(&rows).opened(1);
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
            leaks: vec![region],
            whiskers: Vec::new(),
            missing: vec![region],
        };
        let large = small.clone().enlarged(4);
        assert_eq!(large.area_px, 800);
        assert_eq!(large.leaks[0].px, 48);
        assert_eq!(large.missing[0].bounds, Rect::new(4, 8, 12, 4));
        assert_eq!(small.clone().enlarged(1), small);
    }
}
