//! Photographs to learn from: processor cores cast views once, the device lights them many times.
//!
//! | file | concern |
//! | --- | --- |
//! | `lit` | views in a light |
//! | `camera`, `jpeg` | from light to camera values |
//! | `truth` | the network's input, and its ground truth |
//!
//! A batch is a function of the settings and its step, whatever the number of threads and processes.

mod camera;
mod jpeg;
mod lit;
mod truth;

use tch::no_grad;

use self::camera::photograph;
use self::lit::LitBatch;
use super::sample::TruthBatch;
use super::symmetry::Symmetry;
use super::view_pool::{PooledView, SourceSeeds, ViewSource};
use crate::engine::task::Resources;
use crate::error::TrainError;
use crate::settings::{DataSettings, RunSettings};
use relight_core::light::Order;
use relight_core::reader::Rank;
use relight_synth::{
    EnvironmentLights, Folders, Library, PhotoPlan, PhotoView, SkippedFile, ViewLamp, ViewRecipe,
    stream,
};

/// The visible parts of lamps among a view's planes.
const VISIBILITY: usize = 2;

impl PooledView for PhotoView {
    type Extra = Vec<ViewLamp>;
    type Plan = PhotoPlan;
    const ORDER: Order = Self::ORDER;
    const PLANES: &[(usize, usize)] = &[
        (1, Self::BASE),
        (Self::FINISHES, Self::FINISH_PLANES),
        (Self::LAMPS, 1),
    ];
    const NOISE: usize = 3;

    fn cast(recipe: &ViewRecipe, library: &Library, number: u64) -> Self {
        Self::cast(recipe, library, number)
    }

    fn into_planes(self) -> (Vec<Vec<half::f16>>, Self::Extra) {
        (vec![self.base, self.finishes, self.visibility], self.lamps)
    }

    fn plan(seed: u64, lamps: &Self::Extra, rooms: &EnvironmentLights) -> PhotoPlan {
        PhotoPlan::draw(seed, lamps, rooms)
    }
}

/// The batches of a run, lit while it trains.
#[derive(Debug)]
pub struct Photographs {
    source: ViewSource<PhotoView>,
    data: DataSettings,
    batch: u64,
    seed: u64,
}

impl Photographs {
    /// Reads the files that are named.
    ///
    /// # Errors
    /// [`TrainError::Synth`], [`TrainError::Refused`].
    pub fn new(
        data: &DataSettings,
        run: &RunSettings,
        resources: Resources,
    ) -> Result<Self, TrainError> {
        data.check_batch(run.batch)?;
        let library = Library::read(&Folders {
            meshes: data.meshes.clone(),
            panoramas: data.panoramas.clone(),
        })?;
        let seed = stream(run.seed, 22);
        let seeds = SourceSeeds {
            views: stream(run.seed, 21),
            rooms: stream(run.seed, 24),
            noise: seed,
        };
        let (views, kind) = ((data, data.views), run.precision.kind());
        Ok(Self {
            source: ViewSource::new(views, library.training()?, seeds, kind, resources),
            data: data.clone(),
            batch: run.batch,
            seed,
        })
    }

    /// What views are cast of.
    pub(crate) fn library(&self) -> &Library {
        &self.source.library
    }

    /// Unused files of the folders.
    pub(crate) fn left_out(&self) -> &[SkippedFile] {
        self.source.left_out()
    }

    /// Leaves the rest of each batch to other processes. Called before the first batch.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub(crate) fn set_rank(&mut self, rank: Rank) -> Result<(), TrainError> {
        self.source.set_rank(rank, self.batch)
    }

    /// The batch of a step; steps are asked for one after the other.
    ///
    /// # Errors
    /// [`TrainError::Stopped`] if the run is asked to stop before the views are cast, [`TrainError::Fault`],
    /// [`TrainError::Torch`].
    pub fn batch(&mut self, step: u64) -> Result<TruthBatch, TrainError> {
        let (views, seed) = (self.data.views_at(step), stream(self.seed, step));
        let (open, photos, seeds) = self.source.draw(views, self.batch, seed)?;
        let symmetry = Symmetry::from_bits(stream(seed, u64::MAX));
        Ok(no_grad(|| {
            let lit = LitBatch::new(&open.pool, &open.maps, &photos);
            let noise = (&open.noise, seeds.as_slice());
            let photographed = photograph(&lit.image(), &lit.mask, &photos, noise);
            truth::truth(&lit, &photographed, &photos, symmetry)
        }))
    }
}
