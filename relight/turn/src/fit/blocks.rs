//! A turn on blocks of pixels.

use crate::fit::curve_statistics::{Moments, all_moments};
use crate::fit::joint::Joint;
use crate::fit::normal_step::Expected;
use crate::fit::search::{PixelFit, search_all};
use crate::fit::unknowns::Unknowns;
use crate::model::directions::unit;
use crate::model::shading::Room;
use crate::observe::curves::TurnCurves;

/// Parameters of the blocks.
pub(crate) struct BlockParameters {
    /// Number of blocks, or of pixels, on which the environment light is fitted. By hand.
    pub(crate) pixels: usize,
}

pub(crate) const BLOCK_PARAMETERS: BlockParameters = BlockParameters { pixels: 2500 };

/// A turn on blocks of pixels.
pub(crate) struct Coarse {
    pub(crate) side: usize,
    pub(crate) curves: TurnCurves,
    pub(crate) moments: Vec<Moments>,
    pub(crate) expected: Option<Vec<Expected>>,
}

impl Coarse {
    pub(crate) fn new(curves: &TurnCurves, expected: Option<&[Expected]>) -> Self {
        let pixels = curves.pixels() as f64 / BLOCK_PARAMETERS.pixels as f64;
        let side = (pixels.sqrt().ceil() as usize).max(1);
        let coarse = curves.reduced(side);
        Self {
            side,
            moments: all_moments(&coarse),
            expected: expected.map(|fine| reduced(curves, fine, &coarse, side)),
            curves: coarse,
        }
    }

    /// The same if the table turns the other way.
    pub(crate) fn with_other_sense(self) -> Self {
        let curves = self.curves.with_other_sense();
        Self {
            moments: all_moments(&curves),
            curves,
            ..self
        }
    }

    /// The best normals anywhere, and what they leave.
    pub(crate) fn fits(&self, room: &Room) -> Vec<PixelFit> {
        search_all(room, &self.moments, self.expected.as_deref(), None)
    }

    pub(crate) fn joint<'a>(&'a self, unknowns: Unknowns<'a>) -> Joint<'a> {
        Joint {
            moments: &self.moments,
            expected: self.expected.as_deref(),
            unknowns,
        }
    }
}

/// The prior on blocks of pixels.
pub(crate) fn reduced(
    curves: &TurnCurves,
    fine: &[Expected],
    coarse: &TurnCurves,
    side: usize,
) -> Vec<Expected> {
    let (width, across) = (curves.extent().width, coarse.extent().width);
    let mut sums = vec![[0.0; 3]; coarse.extent().pixels()];
    for (expected, &place) in fine.iter().zip(curves.places()) {
        let block = place / width / side * across + place % width / side;
        for (sum, value) in sums[block].iter_mut().zip(expected.normal) {
            *sum += value;
        }
    }
    let weight = fine.first().map_or(0.0, |expected| expected.weight);
    let at = |&place: &usize| Expected {
        normal: unit(sums[place]),
        weight,
    };
    coarse.places().iter().map(at).collect()
}
