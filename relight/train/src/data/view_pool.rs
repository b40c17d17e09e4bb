//! The views that a step draws from: processor cores cast them once, the device keeps them and lights them many times.

use std::fmt::Debug;
use std::sync::Arc;

use rayon::prelude::*;
use tch::{Device, Kind, Tensor};

use super::direction_maps::DirectionMaps;
use super::noise::NoiseTiles;
use super::view_loader::{Cast, ViewLoader};
use super::view_ring::{ViewPlanes, ViewWindow};
use crate::distributed::process_group::indivisible;
use crate::engine::task::Resources;
use crate::error::TrainError;
use crate::settings::DataSettings;
use relight_core::light::{Order, Panorama};
use relight_core::reader::Rank;
use relight_synth::{EnvironmentLights, Library, SkippedFile, ViewRecipe, stream};

/// A kind of views that are cast once, and drawn from with a plan for each sample.
pub(super) trait PooledView: Sized + Send + 'static {
    /// What a plan needs to know of a view.
    type Extra: Debug + Clone + Default + Sync;
    /// The material, light and camera of a sample.
    type Plan: Send;
    /// The order of light from all around.
    const ORDER: Order;
    /// Of each tensor of planes the parts of a view, and the planes of a part; the first two are [`BASE`] and [`FINISHES`].
    const PLANES: &[(usize, usize)];
    /// Planes of noise.
    const NOISE: usize;

    /// Casts the view of a number.
    fn cast(recipe: &ViewRecipe, library: &Library, number: u64) -> Self;
    /// The planes of each tensor, and the rest.
    fn into_planes(self) -> (Vec<Vec<half::f16>>, Self::Extra);
    /// Plans a sample.
    fn plan(seed: u64, extra: &Self::Extra, rooms: &EnvironmentLights) -> Self::Plan;
}

/// Curves of brightness of each panorama.
const VARIANTS: u32 = 8;

/// The planes that do not depend on the material, one part.
pub(super) const BASE: usize = 0;
/// Materials, a part each.
pub(super) const FINISHES: usize = 1;

/// A sample to be made: the view's place in the pool, and all other parameters.
#[derive(Debug, Clone)]
pub(super) struct Planned<P> {
    pub(super) place: usize,
    pub(super) plan: P,
}

/// Views on a device.
#[derive(Debug)]
pub(super) struct ViewPool<V: PooledView> {
    /// As [`PooledView::PLANES`] says.
    planes: Vec<ViewPlanes>,
    /// Of each view.
    pub(super) extra: Vec<V::Extra>,
}

impl<V: PooledView> ViewPool<V> {
    /// Room for so many views of a size; what is computed of them is of a kind.
    pub(super) fn new(views: usize, size: u32, place: (Kind, Device)) -> Self {
        let planes = V::PLANES
            .iter()
            .map(|&(each, planes)| ViewPlanes::new((views, each), [planes, size as usize], place));
        Self {
            planes: planes.collect(),
            extra: vec![V::Extra::default(); views],
        }
    }

    /// Puts a view at a place.
    pub(super) fn put(&mut self, place: usize, view: V) {
        let (values, extra) = view.into_planes();
        for (planes, values) in self.planes.iter().zip(values) {
            planes.put(place, &values);
        }
        self.extra[place] = extra;
    }

    /// The base planes of the views of samples, `samples x planes x side x side`.
    pub(super) fn base(&self, samples: &[Planned<V::Plan>]) -> Tensor {
        self.parts(BASE, samples.iter().map(|one| (one.place, 0)))
    }

    /// Parts of a tensor of planes, each by its view's place and its number.
    pub(super) fn parts(&self, of: usize, chosen: impl Iterator<Item = (usize, usize)>) -> Tensor {
        self.planes[of].of(chosen)
    }
}

/// Views on the device, and those that follow.
#[derive(Debug)]
pub(super) struct OpenPool<V: PooledView> {
    pub(super) loader: ViewLoader<V>,
    pub(super) pool: ViewPool<V>,
    pub(super) maps: DirectionMaps,
    pub(super) noise: NoiseTiles,
}

/// A pool, planned samples of its views, and their seeds.
pub(super) type Draw<'a, V> = (
    &'a OpenPool<V>,
    Vec<Planned<<V as PooledView>::Plan>>,
    Vec<u64>,
);

/// Views of a library, in its rooms.
#[derive(Debug)]
pub(super) struct ViewSource<V: PooledView> {
    pub(super) library: Arc<Library>,
    recipe: ViewRecipe,
    rooms: EnvironmentLights,
    /// The most views of a draw.
    views: u64,
    noise_seed: u64,
    kind: Kind,
    rank: Rank,
    resources: Resources,
    /// Opened with the first draw, at the position of its step.
    open: Option<OpenPool<V>>,
}

/// The seeds of a source.
#[derive(Debug, Clone, Copy)]
pub(super) struct SourceSeeds {
    pub(super) views: u64,
    pub(super) rooms: u64,
    pub(super) noise: u64,
}

impl<V: PooledView> ViewSource<V> {
    /// At most so many views of a library at a time.
    pub(super) fn new(
        (settings, views): (&DataSettings, u64),
        library: Library,
        seeds: SourceSeeds,
        kind: Kind,
        resources: Resources,
    ) -> Self {
        let panoramas: Vec<&Panorama> = (0..library.panoramas.len())
            .filter_map(|number| library.panoramas.get(number))
            .collect();
        Self {
            rooms: EnvironmentLights::new(&panoramas, VARIANTS, seeds.rooms),
            recipe: ViewRecipe {
                seed: seeds.views,
                size: settings.size,
                rays: settings.rays,
            },
            library: Arc::new(library),
            views,
            noise_seed: seeds.noise,
            kind,
            rank: Rank::ONLY,
            resources,
            open: None,
        }
    }

    /// Unused files of the folders.
    pub(super) fn left_out(&self) -> &[SkippedFile] {
        &self.library.left_out
    }

    /// Leaves the rest of each batch to other processes. Called before the first draw.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub(super) fn set_rank(&mut self, rank: Rank, batch: u64) -> Result<(), TrainError> {
        let of = rank.world_size();
        if !batch.is_multiple_of(u64::from(of)) {
            let needed = format!("a multiple of {of}");
            return Err(indivisible("run.batch", batch, rank, &needed));
        }
        self.rank = rank;
        Ok(())
    }

    /// Frees what the draws so far were made from.
    pub(super) fn close(&mut self) {
        self.open = None;
    }

    /// This process's samples of a batch, planned, with their seeds, and the views they are of: those of the numbers from the
    /// oldest to before the end. The views of each draw come after those of the last.
    ///
    /// # Errors
    /// [`TrainError::Stopped`] if the run is asked to stop before the views are cast, [`TrainError::Fault`],
    /// [`TrainError::Torch`].
    pub(super) fn draw(
        &mut self,
        (oldest, end): (u64, u64),
        batch: u64,
        seed: u64,
    ) -> Result<Draw<'_, V>, TrainError> {
        let rank = self.rank;
        let window = ViewWindow {
            oldest,
            end,
            batch,
            rank,
        };
        let mut open = match self.open.take() {
            Some(open) => open,
            None => self.opened(oldest)?,
        };
        let ring = open.pool.extra.len();
        while open.loader.next_number() < end {
            let place = window.place(open.loader.next_number(), ring);
            open.pool.put(place, open.loader.next_view()?);
        }
        let (seeds, places) = window.draw(seed, ring);
        let (rooms, extra) = (&self.rooms, &open.pool.extra);
        let planned = seeds.par_iter().zip(places).map(|(&seed, place)| Planned {
            place,
            plan: V::plan(stream(seed, 1), &extra[place], rooms),
        });
        let planned = planned.collect();
        Ok((self.open.insert(open), planned, seeds))
    }

    /// A pool whose first view is that of a number.
    fn opened(&self, first: u64) -> Result<OpenPool<V>, TrainError> {
        let place = (self.kind, self.resources.device);
        let views = ViewWindow::ring(self.views, self.rank);
        let (library, recipe) = (Arc::clone(&self.library), self.recipe.clone());
        let cast: Cast<V> = Arc::new(move |number| V::cast(&recipe, &library, number));
        let planes = [V::NOISE as i64, i64::from(self.recipe.size)];
        Ok(OpenPool {
            pool: ViewPool::new(views, self.recipe.size, place),
            loader: ViewLoader::start(&cast, self.rank, first, &self.resources)?,
            maps: DirectionMaps::new(V::ORDER, place),
            noise: NoiseTiles::new((planes[0], planes[1]), self.noise_seed, place.1),
        })
    }
}
