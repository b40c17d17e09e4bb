//! Threads that cast views ahead of the network that learns from them, handed out in the order of their numbers.
//!
//! View n is a pure function of the recipe, the library and n, whatever the number of threads: a run that is resumed sees the
//! views that it would have seen.

use std::collections::BTreeMap;
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

use crate::error::TrainError;
use relight_core::reader::Rank;
use relight_synth::{Library, PhotoView, PhotoViewRecipe};

/// Views that wait to be taken, for each thread.
const AHEAD: usize = 2;
/// How often a loader that waits looks whether it is to stop.
const LOOK: Duration = Duration::from_millis(100);

const NOT_CAST: TrainError = TrainError::Fault("a view could not be cast");

/// What views are cast of.
#[derive(Debug)]
pub(super) struct ViewSource {
    pub(super) recipe: PhotoViewRecipe,
    pub(super) library: Library,
}

/// A view, by its number; `None` if casting it panicked.
type Cast = (u64, Option<PhotoView>);

/// Threads that cast views.
#[derive(Debug)]
pub(super) struct ViewLoader {
    views: Receiver<Cast>,
    /// Views that came before their turn.
    early: BTreeMap<u64, PhotoView>,
    next: u64,
    /// From one view of this process to the next.
    stride: u64,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl ViewLoader {
    /// Threads that cast one process's views from the number `first` on: view n is that of rank n modulo the world size.
    /// `stop` ends waiting for one.
    ///
    /// # Errors
    /// [`TrainError::Io`].
    pub(super) fn start(
        source: &Arc<ViewSource>,
        rank: Rank,
        first: u64,
        threads: usize,
        stop: Arc<AtomicBool>,
    ) -> Result<Self, TrainError> {
        let threads = threads.max(1);
        let (sender, views) = bounded(AHEAD * threads);
        let (index, stride) = (u64::from(rank.index()), u64::from(rank.world_size()));
        let first = first + (index + stride - first % stride) % stride;
        let next = Arc::new(AtomicU64::new(first));
        let spawn = |number: usize| {
            let (source, next) = (Arc::clone(source), Arc::clone(&next));
            let sender: Sender<Cast> = sender.clone();
            thread::Builder::new()
                .name(format!("cast-{number}"))
                .spawn(move || {
                    loop {
                        let number = next.fetch_add(stride, Ordering::Relaxed);
                        // The one that waits for this view has to learn of a panic: the other threads go on.
                        let cast = AssertUnwindSafe(|| source.recipe.cast(&source.library, number));
                        let view = panic::catch_unwind(cast).ok();
                        // Nobody takes views any more once the loader is dropped.
                        if sender.send((number, view)).is_err() {
                            return;
                        }
                    }
                })
                .map_err(TrainError::io(
                    Path::new("the threads that cast views"),
                    "started",
                ))
        };
        let threads = (0..threads).map(spawn).collect::<Result<_, _>>()?;
        Ok(Self {
            views,
            early: BTreeMap::new(),
            next: first,
            stride,
            stop,
            threads,
        })
    }

    /// The number of the next view.
    pub(super) fn next_number(&self) -> u64 {
        self.next
    }

    /// The next view.
    ///
    /// # Errors
    /// [`TrainError::Fault`] if casting panicked: a fault of the program. [`TrainError::Stopped`].
    pub(super) fn next_view(&mut self) -> Result<PhotoView, TrainError> {
        loop {
            if let Some(view) = self.early.remove(&self.next) {
                self.next += self.stride;
                return Ok(view);
            }
            if self.stop.load(Ordering::Relaxed) {
                return Err(TrainError::Stopped);
            }
            match self.views.recv_timeout(LOOK) {
                Ok((number, view)) => {
                    self.early.insert(number, view.ok_or(NOT_CAST)?);
                }
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Err(NOT_CAST),
            }
        }
    }
}

impl Drop for ViewLoader {
    fn drop(&mut self) {
        // Without a receiver, threads end after the view they are at.
        self.views = bounded(0).1;
        for thread in self.threads.drain(..) {
            // What panics in one is caught in it.
            let _ = thread.join();
        }
    }
}
