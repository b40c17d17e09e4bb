//! Photographs to learn from: processor cores cast views once, the device lights them many times.
//!
//! | file | concern |
//! | --- | --- |
//! | `view_pool` | the views of a step, on the device |
//! | `lit` | views in a light |
//! | `camera`, `jpeg` | from light to camera values |
//! | `truth` | the network's input, and its ground truth |
//!
//! A batch is a function of the settings and its step, whatever the number of threads and processes.

mod camera;
mod jpeg;
mod lit;
mod truth;
mod view_pool;

use std::sync::Arc;

use rayon::prelude::*;
use tch::{Kind, no_grad};

use self::camera::photograph;
use self::lit::{LitBatch, PlannedPhoto};
use self::view_pool::ViewPool;
use super::direction_maps::DirectionMaps;
use super::noise::NoiseTiles;
use super::sample::TruthBatch;
use super::symmetry::Symmetry;
use super::view_loader::{Cast, ViewLoader};
use super::view_ring::ViewWindow;
use crate::distributed::process_group::indivisible;
use crate::engine::task::Resources;
use crate::error::TrainError;
use crate::settings::{DataSettings, RunSettings};
use relight_core::light::Panorama;
use relight_core::reader::Rank;
use relight_synth::{
    EnvironmentLights, Folders, Library, PhotoPlan, PhotoView, PhotoViewRecipe, SkippedFile, stream,
};

/// The batches of a run, lit while it trains.
#[derive(Debug)]
pub struct Photographs {
    library: Arc<Library>,
    recipe: PhotoViewRecipe,
    rooms: EnvironmentLights,
    data: DataSettings,
    batch: u64,
    seed: u64,
    kind: Kind,
    rank: Rank,
    resources: Resources,
    /// Opened with the first batch, at the position of its step.
    open: Option<OpenPool>,
}

/// Views on the device, and those that follow.
#[derive(Debug)]
struct OpenPool {
    loader: ViewLoader<PhotoView>,
    pool: ViewPool,
    maps: DirectionMaps,
    noise: NoiseTiles,
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
            textures: data.textures.clone(),
            panoramas: data.panoramas.clone(),
        })?
        .training()?;
        let panoramas: Vec<&Panorama> = (0..library.panoramas.len())
            .filter_map(|number| library.panoramas.get(number))
            .collect();
        Ok(Self {
            rooms: EnvironmentLights::new(&panoramas, data.variants, stream(run.seed, 24)),
            recipe: PhotoViewRecipe {
                seed: stream(run.seed, 21),
                size: data.size,
                rays: data.rays,
            },
            library: Arc::new(library),
            data: data.clone(),
            batch: run.batch,
            seed: stream(run.seed, 22),
            kind: run.precision.kind(),
            rank: Rank::ONLY,
            resources,
            open: None,
        })
    }

    /// What views are cast of.
    pub(crate) fn library(&self) -> &Library {
        &self.library
    }

    /// Unused files of the folders.
    pub(crate) fn left_out(&self) -> &[SkippedFile] {
        &self.library.left_out
    }

    /// Leaves the rest of each batch to other processes. Called before the first batch.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub(crate) fn set_rank(&mut self, rank: Rank) -> Result<(), TrainError> {
        let of = rank.world_size();
        if !self.batch.is_multiple_of(u64::from(of)) {
            let needed = format!("a multiple of {of}");
            return Err(indivisible("run.batch", self.batch, rank, &needed));
        }
        self.rank = rank;
        Ok(())
    }

    /// The batch of a step; steps are asked for one after the other.
    ///
    /// # Errors
    /// [`TrainError::Stopped`] if the run is asked to stop before the views are cast, [`TrainError::Fault`],
    /// [`TrainError::Torch`].
    pub fn batch(&mut self, step: u64) -> Result<TruthBatch, TrainError> {
        let end = self.data.views_at(step);
        let window = ViewWindow {
            oldest: end - self.data.views,
            end,
            batch: self.batch,
            rank: self.rank,
        };
        let mut open = match self.open.take() {
            Some(open) => open,
            None => self.opened(window.oldest)?,
        };
        while open.loader.next_number() < end {
            let place = window.place(open.loader.next_number(), open.pool.len());
            open.pool.put(place, open.loader.next_view()?)?;
        }
        let (seeds, places) = window.draw(stream(self.seed, step), open.pool.len());
        let (rooms, lamps) = (&self.rooms, open.pool.lamps());
        let photos: Vec<PlannedPhoto> = seeds
            .par_iter()
            .zip(places)
            .map(|(&seed, place)| PlannedPhoto {
                place,
                plan: PhotoPlan::draw(stream(seed, 1), &lamps[place], rooms),
            })
            .collect();
        let symmetry = Symmetry::from_bits(stream(stream(self.seed, step), u64::MAX));
        let batch = no_grad(|| {
            let lit = LitBatch::new(&open.pool, &open.maps, &photos)?;
            let noise = (&open.noise, seeds.as_slice());
            let photographed = photograph(&lit.image()?, &lit.mask, &photos, noise)?;
            truth::truth(&lit, &photographed, &photos, symmetry)
        })?;
        self.open = Some(open);
        Ok(batch)
    }

    /// A pool whose first view is that of a number.
    fn opened(&self, first: u64) -> Result<OpenPool, TrainError> {
        let device = self.resources.device;
        let views = ViewWindow::ring(self.data.views, self.rank);
        let pool = ViewPool::new(views, self.data.size, (self.kind, device))?;
        let (library, recipe) = (Arc::clone(&self.library), self.recipe.clone());
        let cast: Cast<PhotoView> = Arc::new(move |number| recipe.cast(&library, number));
        Ok(OpenPool {
            loader: ViewLoader::start(&cast, self.rank, first, &self.resources)?,
            maps: DirectionMaps::new(PhotoView::ORDER, (self.kind, device))?,
            noise: NoiseTiles::new((3, pool.side()), self.seed, device)?,
            pool,
        })
    }
}
