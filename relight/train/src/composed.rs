//! From settings to composed samples.

use std::sync::Arc;

use tch::Kind;

use super::data_loader::Composition;
use super::error::TrainError;
use super::sample::TruthBatch;
use super::settings::{DataSettings, RunSettings};
use super::shuffle_buffer::{ShuffleBuffer, ShuffleBufferSettings};
use super::task::Resources;
use relight_core::reader::Rank;
use relight_synth::{Folders, LeftOut, Library, Recipe, stream};

/// The batches of a run, composed while it trains.
#[derive(Debug)]
pub(super) struct ComposedBatches {
    composition: Arc<Composition>,
    settings: ShuffleBufferSettings,
    rank: Rank,
    kind: Kind,
    resources: Resources,
    /// Opened with the first batch, whose step says where.
    buffer: Option<ShuffleBuffer>,
}

impl ComposedBatches {
    /// What of the folders is not used.
    pub(super) fn left_out(&self) -> &[LeftOut] {
        &self.composition.library.left_out
    }

    /// What they are composed of.
    pub(super) fn composition(&self) -> &Composition {
        &self.composition
    }

    /// Reads the files that are named.
    ///
    /// # Errors
    /// [`TrainError::Synth`].
    pub(super) fn new(
        data: &DataSettings,
        run: &RunSettings,
        resources: Resources,
    ) -> Result<Self, TrainError> {
        let library = Library::read(&Folders {
            meshes: data.meshes.clone(),
            textures: data.textures.clone(),
            panoramas: data.panoramas.clone(),
        })?
        .training()?;
        let recipe = Recipe {
            seed: stream(run.seed, 21),
            size: data.size,
            views: data.views,
            lightings: data.lightings,
            ..Recipe::default()
        };
        recipe.check()?;
        Ok(Self {
            composition: Arc::new(Composition { recipe, library }),
            settings: ShuffleBufferSettings {
                capacity: data.shuffle_buffer,
                lightings: u64::from(data.lightings).max(1),
                reuse: data.reuse,
                batch: run.batch,
                seed: stream(run.seed, 22),
            },
            rank: Rank::ONLY,
            kind: run.precision.kind(),
            resources,
            buffer: None,
        })
    }

    /// Leaves the rest of each batch to other processes. Called before the first batch.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub(super) fn set_rank(&mut self, rank: Rank) -> Result<(), TrainError> {
        self.settings.check(rank)?;
        self.rank = rank;
        Ok(())
    }

    /// The batch of a step; steps are asked for one after the other.
    pub(super) fn batch(&mut self, step: u64) -> Result<TruthBatch, TrainError> {
        let buffer = match self.buffer.take() {
            Some(buffer) => buffer,
            None => ShuffleBuffer::open(
                self.settings,
                self.rank,
                &self.composition,
                &self.resources,
                step,
            )?,
        };
        let buffer = self.buffer.insert(buffer);
        TruthBatch::new(&buffer.batch(step)?, self.kind, self.resources.device)
    }
}
