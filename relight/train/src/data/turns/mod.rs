//! Turns to learn from: processor cores cast views once, the device lights them over whole turns, as curves of brightness.
//!
//! | file | concern |
//! | --- | --- |
//! | `turn_pool` | the views of a step, on the device |
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
mod turn_pool;

use std::path::PathBuf;
use std::sync::Arc;

use rayon::prelude::*;
use tch::{Kind, Tensor, no_grad};

use self::camera::filmed;
use self::input::network_input;
use self::lit::{LitTurns, PlannedTurn};
use self::turn_pool::TurnPool;
use super::direction_maps::DirectionMaps;
use super::noise::NoiseTiles;
use super::view_loader::{Cast, ViewLoader};
use super::view_ring::ViewWindow;
use crate::engine::task::Resources;
use crate::error::TrainError;
use crate::settings::TransferSettings;
use relight_core::light::Panorama;
use relight_core::reader::Rank;
use relight_synth::{
    CURVE_TERMS, EnvironmentLights, Folders, Library, SkippedFile, TurnPlan, TurnView,
    TurnViewRecipe, is_packed, stream,
};

/// Views that are drawn for training, for validation.
const TRAINING: u64 = 41;
const VALIDATION: u64 = 42;
/// The least albedo whose logarithm is learned.
const MIN_ALBEDO: f64 = 0.002;

/// The batches of a run, lit while it trains.
#[derive(Debug)]
pub(crate) struct Turns {
    library: Arc<Library>,
    recipe: TurnViewRecipe,
    rooms: EnvironmentLights,
    /// The most views of a batch.
    views: u64,
    kind: Kind,
    rank: Rank,
    resources: Resources,
    /// Opened with the first batch, at the position of its step.
    open: Option<OpenPool>,
}

/// Views on the device, and those that follow.
#[derive(Debug)]
struct OpenPool {
    loader: ViewLoader<TurnView>,
    pool: TurnPool,
    maps: DirectionMaps,
    noise: NoiseTiles,
}

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

/// From which views a batch is drawn: from those of these numbers, by a seed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TurnDraw {
    /// The oldest view.
    pub(crate) oldest: u64,
    /// The first view that is not one of them.
    pub(crate) end: u64,
    /// Samples of a batch.
    pub(crate) batch: u64,
    /// The seed of all draws.
    pub(crate) seed: u64,
}

impl Turns {
    /// For training: files of folders, and the training part of packed libraries.
    pub(crate) fn for_training(
        settings: &TransferSettings,
        (seed, kind): (u64, Kind),
        resources: Resources,
    ) -> Result<Self, TrainError> {
        let (meshes, panoramas) = (settings.meshes.clone(), settings.panoramas.clone());
        let library = read(meshes, panoramas)?.training()?;
        let recipe = recipe(settings, stream(seed, TRAINING));
        Ok(Self::new(
            settings,
            library,
            recipe,
            (settings.views, kind),
            resources,
        ))
    }

    /// For validation, the same for all seeds: procedural shapes and the validation part of a packed library, in the panoramas
    /// for validation.
    pub(crate) fn for_validation(
        settings: &TransferSettings,
        kind: Kind,
        resources: Resources,
    ) -> Result<Self, TrainError> {
        // Meshes of a folder are learned from.
        let meshes = settings.meshes.clone().filter(|path| is_packed(path));
        let library = read(meshes, settings.validation_panoramas.clone())?.validation()?;
        let recipe = recipe(settings, VALIDATION);
        let views = settings.validation;
        Ok(Self::new(
            settings,
            library,
            recipe,
            (views, kind),
            resources,
        ))
    }

    fn new(
        settings: &TransferSettings,
        library: Library,
        recipe: TurnViewRecipe,
        (views, kind): (u64, Kind),
        resources: Resources,
    ) -> Self {
        let panoramas: Vec<&Panorama> = (0..library.panoramas.len())
            .filter_map(|number| library.panoramas.get(number))
            .collect();
        Self {
            rooms: EnvironmentLights::new(&panoramas, settings.variants, recipe.seed),
            recipe,
            library: Arc::new(library),
            views,
            kind,
            rank: Rank::ONLY,
            resources,
            open: None,
        }
    }

    /// Frees what the batches so far were made from.
    pub(crate) fn close(&mut self) {
        self.open = None;
    }

    /// Unused files of the folders.
    pub(crate) fn left_out(&self) -> &[SkippedFile] {
        &self.library.left_out
    }

    /// Leaves the rest of each batch to other processes. Called before the first batch.
    pub(crate) fn set_rank(&mut self, rank: Rank) {
        self.rank = rank;
    }

    /// This process's part of a batch; the views of each come after those of the last.
    ///
    /// # Errors
    /// [`TrainError::Stopped`] if the run is asked to stop before the views are cast, [`TrainError::Fault`],
    /// [`TrainError::Torch`].
    pub(crate) fn batch(&mut self, draw: TurnDraw) -> Result<TurnBatch, TrainError> {
        let window = ViewWindow {
            oldest: draw.oldest,
            end: draw.end,
            batch: draw.batch,
            rank: self.rank,
        };
        let mut open = match self.open.take() {
            Some(open) => open,
            None => self.opened(draw.oldest)?,
        };
        while open.loader.next_number() < draw.end {
            let place = window.place(open.loader.next_number(), open.pool.len());
            open.pool.put(place, &open.loader.next_view()?)?;
        }
        let (seeds, places) = window.draw(draw.seed, open.pool.len());
        let (rooms, elevations) = (&self.rooms, open.pool.elevations());
        let turns: Vec<PlannedTurn> = seeds
            .par_iter()
            .zip(places)
            .map(|(&seed, place)| PlannedTurn {
                place,
                plan: TurnPlan::draw(stream(seed, 1), elevations[place], rooms),
            })
            .collect();
        let batch = no_grad(|| batch_of(&open, &turns, &seeds))?;
        self.open = Some(open);
        Ok(batch)
    }

    /// A pool whose first view is that of a number.
    fn opened(&self, first: u64) -> Result<OpenPool, TrainError> {
        let place = (self.kind, self.resources.device);
        let views = ViewWindow::ring(self.views, self.rank);
        let pool = TurnPool::new(views, self.recipe.size, place)?;
        let (library, recipe) = (Arc::clone(&self.library), self.recipe.clone());
        let cast: Cast<TurnView> = Arc::new(move |number| recipe.cast(&library, number));
        let planes = (3 * (CURVE_TERMS - 1)) as i64;
        Ok(OpenPool {
            loader: ViewLoader::start(&cast, self.rank, first, &self.resources)?,
            maps: DirectionMaps::new(TurnView::ORDER, place)?,
            noise: NoiseTiles::new((planes, pool.side()), self.recipe.seed, place.1)?,
            pool,
        })
    }
}

fn recipe(settings: &TransferSettings, seed: u64) -> TurnViewRecipe {
    TurnViewRecipe {
        seed,
        size: settings.size,
        rays: settings.rays,
    }
}

fn read(meshes: Option<PathBuf>, panoramas: Option<PathBuf>) -> Result<Library, TrainError> {
    Ok(Library::read(&Folders {
        meshes,
        textures: None,
        panoramas,
    })?)
}

fn batch_of(
    open: &OpenPool,
    turns: &[PlannedTurn],
    seeds: &[u64],
) -> Result<TurnBatch, TrainError> {
    let lit = LitTurns::new(&open.pool, &open.maps, turns)?;
    let noise = open.noise.of(seeds, lit.curves.kind())?;
    let seen = filmed(lit, turns, &noise)?;
    Ok(TurnBatch {
        input: network_input(&seen.curves, &seen.mask, turns)?,
        log_albedo: seen
            .albedo
            .f_clamp_min(MIN_ALBEDO)?
            .f_log()?
            .f_mul(&seen.mask)?,
        normals: seen.normals,
        mask: seen.mask,
    })
}
