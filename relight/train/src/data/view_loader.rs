//! Threads that cast views ahead of the network that learns from them, handed out in the order of their numbers.
//!
//! View n is a pure function of n, whatever the number of threads: a run that is resumed sees the
//! views that it would have seen.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::engine::task::Resources;
use crate::error::TrainError;
use relight_core::reader::Rank;

/// Views that wait to be taken, for each thread.
const AHEAD: usize = 2;
/// How often a loader that waits looks whether it is to stop.
const LOOK: Duration = Duration::from_millis(100);

const NOT_CAST: TrainError = TrainError::Fault("a view could not be cast");

/// Casts the view of a number.
pub(super) type Cast<V> = Arc<dyn Fn(u64) -> V + Send + Sync>;

/// Threads that cast views.
#[derive(Debug)]
pub(super) struct ViewLoader<V> {
    /// One queue a thread: thread `i` of `n` casts views `i`, `i + n`, `i + 2 n`, ... of this process.
    queues: Vec<Receiver<V>>,
    /// The queue of the next view.
    turn: usize,
    next: u64,
    /// From one view of this process to the next.
    stride: u64,
    stop: Arc<AtomicBool>,
    threads: Vec<JoinHandle<()>>,
}

impl<V: Send + 'static> ViewLoader<V> {
    /// Threads that cast one process's views from the number `first` on: view n is that of rank n modulo the world size.
    /// Where the run is asked to stop, waiting for one ends.
    ///
    /// # Errors
    /// [`TrainError::Io`].
    pub(super) fn start(
        cast: &Cast<V>,
        rank: Rank,
        first: u64,
        resources: &Resources,
    ) -> Result<Self, TrainError> {
        // The other processes of a group wait for this one's first step.
        let stop = if rank == Rank::ONLY {
            Arc::clone(&resources.stop)
        } else {
            Arc::default()
        };
        let count = resources.workers.max(1);
        let (index, stride) = (u64::from(rank.index()), u64::from(rank.world_size()));
        let first = first + (index + stride - first % stride) % stride;
        let mut loader = Self {
            queues: Vec::with_capacity(count),
            turn: 0,
            next: first,
            stride,
            stop,
            threads: Vec::with_capacity(count),
        };
        for thread in 0..count {
            let (sender, views) = sync_channel(AHEAD);
            let cast = Arc::clone(cast);
            let numbers = (first + thread as u64 * stride..).step_by(count * stride as usize);
            let work = move || {
                for number in numbers {
                    // Nobody takes views any more once the loader is dropped.
                    if sender.send(cast(number)).is_err() {
                        return;
                    }
                }
            };
            let thread = thread::Builder::new().name(format!("cast-{thread}"));
            let thread = thread.spawn(work).map_err(TrainError::io(
                Path::new("the threads that cast views"),
                "started",
            ))?;
            loader.queues.push(views);
            loader.threads.push(thread);
        }
        Ok(loader)
    }

    /// The number of the next view.
    pub(super) fn next_number(&self) -> u64 {
        self.next
    }

    /// The next view.
    ///
    /// # Errors
    /// [`TrainError::Fault`] if casting panicked: a fault of the program. [`TrainError::Stopped`].
    pub(super) fn next_view(&mut self) -> Result<V, TrainError> {
        loop {
            if self.stop.load(Ordering::Relaxed) {
                return Err(TrainError::Stopped);
            }
            match self.queues[self.turn].recv_timeout(LOOK) {
                Ok(view) => {
                    self.turn = (self.turn + 1) % self.queues.len();
                    self.next += self.stride;
                    return Ok(view);
                }
                Err(RecvTimeoutError::Timeout) => {}
                // Casting panicked.
                Err(RecvTimeoutError::Disconnected) => return Err(NOT_CAST),
            }
        }
    }
}

impl<V> Drop for ViewLoader<V> {
    fn drop(&mut self) {
        // Without a receiver, threads end after the view they are at.
        self.queues.clear();
        for thread in self.threads.drain(..) {
            // That one panicked is known by its queue.
            let _ = thread.join();
        }
    }
}
