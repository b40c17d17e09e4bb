//! Turns to learn from: processor cores cast views once, the device lights them over whole turns, as curves of brightness.
//!
//! | file | concern |
//! | --- | --- |
//! | `lit` | the curves of views in a light |
//! | `camera` | clipping, errors of the table's angle, noise |
//! | `input` | the network's input |
//!
//! A batch is a function of the settings and its step, whatever the number of threads and processes.

mod camera;
mod input;
mod lit;
#[cfg(test)]
mod tests;

use tch::{Kind, Tensor, no_grad};

use self::camera::filmed;
use self::input::network_input;
use self::lit::{LitTurns, PlannedTurn};
use super::view_pool::{OpenPool, PooledView, SourceSeeds, ViewSource};
use crate::engine::task::Resources;
use crate::error::TrainError;
use crate::settings::DataSettings;
use relight_core::light::Order;
use relight_core::reader::Rank;
use relight_synth::{
    CURVE_TERMS, EnvironmentLights, Folders, Library, SkippedFile, TurnPlan, TurnView, ViewRecipe,
    is_packed, stream,
};

/// Views that are drawn for training, for validation.
const TRAINING: u64 = 41;
const VALIDATION: u64 = 42;
/// The least albedo whose logarithm is learned.
const MIN_ALBEDO: f64 = 0.002;

impl PooledView for TurnView {
    /// The camera over the table, radians.
    type Extra = f32;
    type Plan = TurnPlan;
    const ORDER: Order = Self::ORDER;
    const PLANES: &[(usize, usize)] = &[(1, Self::BASE), (Self::FINISHES, Self::FINISH_PLANES)];
    const NOISE: usize = 3 * (CURVE_TERMS - 1);

    fn cast(recipe: &ViewRecipe, library: &Library, number: u64) -> Self {
        Self::cast(recipe, library, number)
    }

    fn into_planes(self) -> (Vec<Vec<half::f16>>, f32) {
        (vec![self.base, self.finishes], self.elevation)
    }

    fn plan(seed: u64, elevation: &f32, rooms: &EnvironmentLights) -> TurnPlan {
        TurnPlan::draw(seed, *elevation, rooms)
    }
}

/// The batches of a run, lit while it trains.
#[derive(Debug)]
pub(crate) struct Turns(ViewSource<TurnView>);

/// A batch of turns for the network.
#[derive(Debug)]
pub(crate) struct TurnBatch {
    /// `batch x channels x height x width`.
    pub(crate) input: Tensor,
    /// Unit normals, 3 channels.
    pub(crate) normals: Tensor,
    /// The logarithm of the albedo, 3 channels.
    pub(crate) log_albedo: Tensor,
    /// 1 where the object is, 1 channel.
    pub(crate) mask: Tensor,
}

impl Turns {
    /// For training: files of folders, and the training part of packed libraries.
    pub(crate) fn for_training(
        settings: &DataSettings,
        (seed, kind): (u64, Kind),
        resources: Resources,
    ) -> Result<Self, TrainError> {
        let library = Library::read(&Folders {
            meshes: settings.meshes.clone(),
            panoramas: settings.panoramas.clone(),
        })?;
        let seeds = seeds(stream(seed, TRAINING));
        let (views, library) = ((settings, settings.views), library.training()?);
        Ok(Self(ViewSource::new(
            views, library, seeds, kind, resources,
        )))
    }

    /// For validation, the same for all seeds: procedural shapes and the validation part of a packed library, in the panoramas
    /// for validation.
    pub(crate) fn for_validation(
        settings: &DataSettings,
        kind: Kind,
        resources: Resources,
    ) -> Result<Self, TrainError> {
        let library = Library::read(&Folders {
            // Meshes of a folder are learned from.
            meshes: settings.meshes.clone().filter(|path| is_packed(path)),
            panoramas: settings.validation_panoramas.clone(),
        })?;
        let seeds = seeds(VALIDATION);
        let (views, library) = ((settings, settings.validation), library.validation()?);
        Ok(Self(ViewSource::new(
            views, library, seeds, kind, resources,
        )))
    }

    /// Frees what the batches so far were made from.
    pub(crate) fn close(&mut self) {
        self.0.close();
    }

    /// What the views are of.
    pub(crate) fn library(&self) -> &Library {
        &self.0.library
    }

    /// Unused files of the folders.
    pub(crate) fn left_out(&self) -> &[SkippedFile] {
        self.0.left_out()
    }

    /// Leaves the rest of each batch to other processes. Called before the first batch.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub(crate) fn set_rank(&mut self, rank: Rank, batch: u64) -> Result<(), TrainError> {
        self.0.set_rank(rank, batch)
    }

    /// This process's part of a batch of views, drawn by a seed; the views of each come after those of the last.
    ///
    /// # Errors
    /// [`TrainError::Stopped`] if the run is asked to stop before the views are cast, [`TrainError::Fault`],
    /// [`TrainError::Torch`].
    pub(crate) fn batch(
        &mut self,
        views: (u64, u64),
        batch: u64,
        seed: u64,
    ) -> Result<TurnBatch, TrainError> {
        let (open, turns, seeds) = self.0.draw(views, batch, seed)?;
        Ok(no_grad(|| batch_of(open, &turns, &seeds)))
    }
}

fn seeds(seed: u64) -> SourceSeeds {
    SourceSeeds {
        views: seed,
        rooms: seed,
        noise: seed,
    }
}

fn batch_of(open: &OpenPool<TurnView>, turns: &[PlannedTurn], seeds: &[u64]) -> TurnBatch {
    let lit = LitTurns::new(&open.pool, &open.maps, turns);
    let noise = open.noise.of(seeds, lit.curves.kind());
    let seen = filmed(lit, turns, &noise);
    TurnBatch {
        input: network_input(&seen.curves, &seen.mask, turns),
        log_albedo: seen.albedo.clamp_min(MIN_ALBEDO).log() * &seen.mask,
        normals: seen.normals,
        mask: seen.mask,
    }
}
