//! Frames with labels: pictures of which normals, albedo, shading and highlight are known where their mask says so, as
//! `relight turn --labels` and `relight synth` write them.

use std::path::Path;

use super::data_loader::unit;
use super::error::TrainError;
use super::sample::{DrawnSample, TruthArrays};
use super::symmetry::Symmetry;
use relight_core::image::Extent;
use relight_core::reader::{DamagedSample, Rank, SampleFault, TruthLayout, TruthSet};
use relight_synth::stream;

/// A folder of them.
pub(super) struct LabelledFrames {
    set: TruthSet,
    names: Vec<String>,
    extent: Extent,
    seed: u64,
    rank: Rank,
}

impl std::fmt::Debug for LabelledFrames {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("LabelledFrames")
            .field("frames", &self.names.len())
            .field("extent", &self.extent)
            .finish_non_exhaustive()
    }
}

/// The frames of a step, and what of them was damaged.
#[derive(Debug, Default)]
pub(super) struct LabelledBatch {
    frames: Vec<(TruthArrays, bool)>,
    pub(super) damage: Vec<String>,
}

impl LabelledFrames {
    /// Finds the frames in a folder. The first of them says which size all have.
    pub(super) fn open(path: &Path, seed: u64) -> Result<Self, TrainError> {
        let set = TruthSet::open(path, TruthLayout::Synth)?;
        let first = set.load(0).map_err(TrainError::Label)?;
        let names = set.names().map(str::to_owned).collect();
        let extent = first.extent();
        let is_right = |side: usize| side > 0 && side.is_multiple_of(32);
        if !is_right(extent.width) || !is_right(extent.height) {
            let (width, height) = (extent.width, extent.height);
            return Err(TrainError::LabelSize { width, height });
        }
        Ok(Self {
            set,
            names,
            extent,
            seed,
            rank: Rank::ONLY,
        })
    }

    /// Leaves the rest of each batch to other processes.
    pub(super) fn set_rank(&mut self, rank: Rank) {
        self.rank = rank;
    }

    /// Text that tells folders of labels apart.
    pub(super) fn identity(&self) -> String {
        let Extent { width, height } = self.extent;
        let names = self.names.join(", ");
        format!("labels of {width} x {height} pixels: {names}\n")
    }

    /// This process's part of the `count` frames of a step, half of them mirrored by chance.
    pub(super) fn batch(&self, step: u64, count: u64) -> LabelledBatch {
        let own = u64::from(self.rank.index())..count;
        let mut batch = LabelledBatch::default();
        for place in own.step_by(self.rank.world_size() as usize) {
            let hash = stream(stream(self.seed, step), place);
            let index = (unit(hash) * self.names.len() as f64) as usize;
            match self.load(index) {
                // The bits above draw the frame.
                Ok(arrays) => batch.frames.push((arrays, hash & 1 == 1)),
                Err(damaged) => batch.damage.push(relit_data::causes::with_causes(&damaged)),
            }
        }
        batch
    }

    fn load(&self, index: usize) -> Result<TruthArrays, DamagedSample> {
        let sample = self.set.load(index)?;
        let fault = if sample.extent() == self.extent {
            match TruthArrays::of_truth(&sample) {
                Ok(arrays) => return Ok(arrays),
                Err(part) => SampleFault::missing(part),
            }
        } else {
            let Extent { width, height } = sample.extent();
            SampleFault::Part(format!(
                "its mask has {width} x {height} pixels, as no other picture of the set"
            ))
        };
        Err(DamagedSample {
            sample: sample.name,
            fault,
        })
    }
}

impl LabelledBatch {
    /// The frames, to be made a batch of.
    pub(super) fn drawn(&self) -> Vec<DrawnSample<'_>> {
        let frames = self.frames.iter();
        frames
            .map(|(arrays, mirrored)| DrawnSample {
                arrays,
                symmetry: Symmetry::mirror(*mirrored),
            })
            .collect()
    }
}
