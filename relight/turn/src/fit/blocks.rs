//! A turn on blocks of pixels.

use crate::fit::curve_statistics::{CurveStatistics, all_statistics};
use crate::fit::joint::JointOptimisation;
use crate::fit::normal_step::PriorNormal;
use crate::fit::prior_weight::PriorWeight;
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
    /// Where normals are searched from; anywhere without.
    starts: Option<Vec<PixelFit>>,
}

impl Blocks {
    /// Those of a turn. Where `is_sure`, the prior is near enough for normals to be searched downhill from it.
    pub(crate) fn new(curves: &TurnCurves, prior: Option<&[PriorNormal]>, is_sure: bool) -> Self {
        let pixels = curves.pixels() as f64 / BLOCK_PARAMETERS.pixels as f64;
        let side = (pixels.sqrt().ceil() as usize).max(1);
        let coarse = curves.reduced(side);
        let prior = prior.map(|fine| reduced(curves, fine, &coarse, side));
        Self {
            side,
            statistics: all_statistics(&coarse),
            starts: prior.as_deref().filter(|_| is_sure).map(starts),
            prior,
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

    /// The best normals, and what they leave.
    pub(crate) fn fits(&self, model: &ShadingModel) -> Vec<PixelFit> {
        search_all(
            model,
            &self.statistics,
            self.prior.as_deref(),
            self.starts.as_deref(),
        )
    }

    /// Weights the prior anew by what these fits leave.
    pub(crate) fn balance(&mut self, weight: PriorWeight, fits: &[PixelFit]) {
        if let Some(prior) = &mut self.prior {
            weight.balance(prior, fits);
        }
    }

    pub(crate) fn joint<'a>(&'a self, unknowns: Unknowns<'a>) -> JointOptimisation<'a> {
        JointOptimisation {
            statistics: &self.statistics,
            prior: self.prior.as_deref(),
            starts: self.starts.as_deref(),
            unknowns,
        }
    }
}

/// The prior normals, to search from.
pub(crate) fn starts(prior: &[PriorNormal]) -> Vec<PixelFit> {
    let start = |prior: &PriorNormal| PixelFit {
        normal: prior.normal,
        albedo: [0.0; 3],
        residual: 1.0,
    };
    prior.iter().map(start).collect()
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
    // Sums of the weights and the sureness, and how many there are.
    let mut weights = vec![[0.0; 3]; coarse.extent().pixels()];
    for (prior, &place) in fine.iter().zip(curves.places()) {
        let block = place / width / side * across + place % width / side;
        for (sum, value) in sums[block].iter_mut().zip(prior.normal) {
            *sum += value;
        }
        let one = [prior.weight, prior.sureness, 1.0];
        weights[block]
            .iter_mut()
            .zip(one)
            .for_each(|(sum, one)| *sum += one);
    }
    let at = |&place: &usize| {
        let [weight, sureness, count] = weights[place];
        PriorNormal {
            normal: unit(sums[place]),
            weight: weight / f64::max(count, 1.0),
            sureness: sureness / f64::max(count, 1.0),
        }
    };
    coarse.places().iter().map(at).collect()
}
