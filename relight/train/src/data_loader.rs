//! The data loader: its workers compose samples ahead of the network that trains on them, in the order of their numbers.
//!
//! Sample n is a pure function of the recipe, the library and n, whatever the number of threads: a run that
//! is resumed sees the samples that it would have seen.

use std::collections::BTreeMap;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, JoinHandle};

use crossbeam_channel::{Receiver, Sender, bounded};

use super::error::TrainError;
use super::sample::{Linearisation, TruthArrays};
use relight_core::reader::Rank;
use relight_synth::{Library, Recipe, stream};

/// Part of the pictures whose values are taken for sRGB, whatever the camera's response: the user of a photograph
/// does not know it either. Hardly more, as albedo times shading is not such a picture.
const TAKEN_AS_SRGB: f64 = 0.10;
/// Part of the pictures that a plain camera takes (sRGB, no noise, no compression); the others are taken as the recipe says.
const PLAIN: f64 = 0.5;
/// Views that wait to be taken, for each thread.
const AHEAD: usize = 2;

/// Why there is no sample.
pub(super) const NOT_COMPOSED: TrainError = TrainError::Fault("a sample could not be composed");

/// What samples are composed of.
#[derive(Debug)]
pub struct Composition {
    /// How samples are made.
    pub recipe: Recipe,
    /// What they are made of.
    pub library: Library,
}

/// The samples of one view, by the view's number; none where composing them panicked.
type Batch = (u64, Option<Vec<TruthArrays>>);

/// Workers that compose samples.
#[derive(Debug)]
pub struct DataLoader {
    views: Receiver<Batch>,
    /// Views that came before their turn.
    early: BTreeMap<u64, Vec<TruthArrays>>,
    next_view: u64,
    /// From one view of this process to the next.
    stride: u64,
    /// Of the view that is being handed out, with their numbers, last first.
    current: Vec<(u64, TruthArrays)>,
    threads: Vec<JoinHandle<()>>,
}

impl DataLoader {
    /// Threads that compose one process's views, view n being that of rank n modulo the world size, from the view
    /// `first_view` on.
    ///
    /// # Errors
    /// [`TrainError::Synth`] where the recipe is out of range, [`TrainError::Io`].
    pub fn start(
        composition: Arc<Composition>,
        rank: Rank,
        first_view: u64,
        threads: usize,
    ) -> Result<Self, TrainError> {
        composition.recipe.check()?;
        let threads = threads.max(1);
        let (sender, views) = bounded(AHEAD * threads);
        let (index, stride) = (u64::from(rank.index()), u64::from(rank.world_size()));
        let next_view = first_view + (index + stride - first_view % stride) % stride;
        let next = Arc::new(AtomicU64::new(next_view));
        let spawn = |number: usize| {
            let (composition, next) = (Arc::clone(&composition), Arc::clone(&next));
            let sender: Sender<Batch> = sender.clone();
            thread::Builder::new()
                .name(format!("compose-{number}"))
                .spawn(move || {
                    loop {
                        let view = next.fetch_add(stride, Ordering::Relaxed);
                        // The one that waits for this view has to learn of a panic: the other threads go on.
                        let made = AssertUnwindSafe(|| composition.samples_of(view));
                        let samples = panic::catch_unwind(made).ok();
                        // Nobody takes views any more once the loader is dropped.
                        if sender.send((view, samples)).is_err() {
                            return;
                        }
                    }
                })
                .map_err(TrainError::io(
                    Path::new("the data-loader workers"),
                    "started",
                ))
        };
        let threads = (0..threads).map(spawn).collect::<Result<_, _>>()?;
        Ok(Self {
            views,
            early: BTreeMap::new(),
            next_view,
            stride,
            current: Vec::new(),
            threads,
        })
    }

    /// The next sample, with its number.
    ///
    /// # Errors
    /// [`TrainError::Fault`] where composing panicked: a fault of the program.
    pub fn next_sample(&mut self) -> Result<(u64, TruthArrays), TrainError> {
        loop {
            if let Some(sample) = self.current.pop() {
                return Ok(sample);
            }
            if let Some(samples) = self.early.remove(&self.next_view) {
                let first = self.next_view * samples.len() as u64;
                self.current = (first..).zip(samples).collect();
                self.current.reverse();
                self.next_view += self.stride;
                continue;
            }
            let (view, samples) = self.views.recv().map_err(|_| NOT_COMPOSED)?;
            self.early.insert(view, samples.ok_or(NOT_COMPOSED)?);
        }
    }
}

impl Drop for DataLoader {
    fn drop(&mut self) {
        // Without a receiver, threads end after the view they are at.
        self.views = bounded(0).1;
        for thread in self.threads.drain(..) {
            // What panics in one is caught in it.
            let _ = thread.join();
        }
    }
}

impl Composition {
    /// The samples of a view, as many as [`Recipe::lightings`] says.
    #[must_use]
    pub fn samples_of(&self, view: u64) -> Vec<TruthArrays> {
        let lightings = u64::from(self.recipe.lightings);
        let object = view / u64::from(self.recipe.views);
        let (object, mesh) = self.recipe.object(&self.library, object);
        let seen = self.recipe.view(&object, &mesh, view);
        (view * lightings..(view + 1) * lightings)
            .map(|number| {
                let draw = |which: u64| unit(stream(stream(self.recipe.seed, which), number));
                let recipe = Recipe {
                    random_camera: self.recipe.random_camera && draw(11) >= PLAIN,
                    ..self.recipe.clone()
                };
                let linearisation = if draw(12) < TAKEN_AS_SRGB {
                    Linearisation::AsSrgb
                } else {
                    Linearisation::Exact
                };
                let sample = recipe.sample(&self.library, &seen, number);
                TruthArrays::new(&sample, linearisation)
            })
            .collect()
    }
}

/// A hash as a number in 0..1.
pub(super) fn unit(hash: u64) -> f64 {
    (hash >> 11) as f64 / (1_u64 << 53) as f64
}
