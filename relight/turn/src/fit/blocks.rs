//! A turn on blocks of pixels.

use crate::fit::curve_statistics::{CurveStatistics, all_statistics};
use crate::fit::joint::JointOptimisation;
use crate::fit::normal_step::PriorNormal;
use crate::fit::search::{PixelFit, search_all};
use crate::fit::unknowns::Unknowns;
use crate::model::directions::unit;
use crate::model::shading::ShadingModel;
use crate::observe::curves::TurnCurves;

/// Parameters of the blocks.
pub(crate) struct BlockParameters {
    /// Number of blocks, or of pixels, on which the environment light is fitted. By hand.
    pub(crate) pixels: usize,
}

pub(crate) const BLOCK_PARAMETERS: BlockParameters = BlockParameters { pixels: 2500 };

/// A turn on blocks of pixels.
pub(crate) struct Blocks {
    pub(crate) side: usize,
    pub(crate) curves: TurnCurves,
    pub(crate) statistics: Vec<CurveStatistics>,
    pub(crate) prior: Option<Vec<PriorNormal>>,
}

impl Blocks {
    pub(crate) fn new(curves: &TurnCurves, prior: Option<&[PriorNormal]>) -> Self {
        let pixels = curves.pixels() as f64 / BLOCK_PARAMETERS.pixels as f64;
        let side = (pixels.sqrt().ceil() as usize).max(1);
        let coarse = curves.reduced(side);
        Self {
            side,
            statistics: all_statistics(&coarse),
            prior: prior.map(|fine| reduced(curves, fine, &coarse, side)),
            curves: coarse,
        }
    }

    /// The same if the table turns the other way.
    pub(crate) fn with_other_direction(self) -> Self {
        let curves = self.curves.with_other_direction();
        Self {
            statistics: all_statistics(&curves),
            curves,
            ..self
        }
    }

    /// The best normals anywhere, and what they leave.
    pub(crate) fn fits(&self, model: &ShadingModel) -> Vec<PixelFit> {
        search_all(model, &self.statistics, self.prior.as_deref(), None)
    }

    pub(crate) fn joint<'a>(&'a self, unknowns: Unknowns<'a>) -> JointOptimisation<'a> {
        JointOptimisation {
            statistics: &self.statistics,
            prior: self.prior.as_deref(),
            unknowns,
        }
    }
}

/// The prior on blocks of pixels.
pub(crate) fn reduced(
    curves: &TurnCurves,
    fine: &[PriorNormal],
    coarse: &TurnCurves,
    side: usize,
) -> Vec<PriorNormal> {
    let (width, across) = (curves.extent().width, coarse.extent().width);
    let mut sums = vec![[0.0; 3]; coarse.extent().pixels()];
    // Sum of the weights, and how many there are.
    let mut weights = vec![(0.0, 0.0); coarse.extent().pixels()];
    for (prior, &place) in fine.iter().zip(curves.places()) {
        let block = place / width / side * across + place % width / side;
        for (sum, value) in sums[block].iter_mut().zip(prior.normal) {
            *sum += value;
        }
        let (sum, count) = &mut weights[block];
        *sum += prior.weight;
        *count += 1.0;
    }
    let at = |&place: &usize| PriorNormal {
        normal: unit(sums[place]),
        weight: weights[place].0 / f64::max(weights[place].1, 1.0),
    };
    coarse.places().iter().map(at).collect()
}
