//! Batches, decoded in threads ahead of whoever trains on them. Knows nothing of files.

use std::num::NonZeroUsize;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

use super::draw_plan::Job;
use super::{Cursor, DamagedBatch, DamagedSample, DrawPlan, ReadError, SampleId};

/// A set of samples that batches can be drawn from.
pub trait Source: Send + Sync + 'static {
    /// What the samples of a batch become.
    type Batch: Send + 'static;

    /// How many samples each turn has, damaged ones included.
    fn turns(&self) -> Vec<u32>;

    /// The batch of these samples, and those of them that are damaged and not in it. May be called
    /// from many threads at a time. `spare` is a batch that is no longer needed, whose memory can be
    /// used again.
    fn batch(
        &self,
        samples: &[SampleId],
        spare: Option<Self::Batch>,
    ) -> (Self::Batch, Vec<DamagedSample>);
}

/// The range of the stream, and the number of its threads.
#[derive(Debug, Clone, Copy)]
pub struct Streaming {
    /// Which samples make which batch.
    pub plan: DrawPlan,
    /// Where to begin.
    pub from: Cursor,
    /// The epoch before which the stream ends: 1 for one time through all samples, `u64::MAX` for
    /// a stream without an end.
    pub until_epoch: u64,
    /// Threads that decode.
    pub threads: NonZeroUsize,
    /// The number of finished batches that each keeps ready, at least 1.
    pub ahead: usize,
}

/// A batch, and the cursor after it.
#[derive(Debug, Clone, PartialEq)]
pub struct StreamedBatch<B> {
    /// The samples.
    pub batch: B,
    /// The cursor behind them.
    pub next: Cursor,
}

/// An iterator over batches in the order of the plan, whatever the number of threads.
///
/// A batch with damaged samples is an error that contains its intact samples; the stream continues
/// after it. Memory is bounded: each thread works on one batch and keeps `ahead` more. Dropped, it
/// ends its threads.
///
/// ```no_run
/// use std::num::NonZeroUsize;
/// use std::path::Path;
/// use std::sync::{Arc, Mutex};
/// use relight_core::reader::{DrawPlan, Encoding, Cursor, Stream, Streaming, Turns};
///
/// let turns = Arc::new(Turns::open(Path::new("data"), Encoding::Srgb)?);
/// let streaming = Streaming {
///     plan: DrawPlan::from_turns(1),
///     from: Cursor::default(),
///     until_epoch: 3,
///     threads: NonZeroUsize::MIN,
///     ahead: 4,
/// };
/// let mut stream = Stream::start(&turns, streaming)?;
/// while let Some(drawn) = stream.next() {
///     let drawn = drawn.unwrap_or_else(|damaged| {
///         eprintln!("{damaged}");
///         damaged.rest
///     });
///     let (_images, _checkpoint) = (&drawn.batch.images, drawn.next);
///     stream.recycle(drawn.batch);
/// }
/// # Ok::<(), relight_core::reader::ReadError>(())
/// ```
pub struct Stream<S: Source> {
    /// One queue a thread: thread `i` of `n` makes batches `i`, `i + n`, `i + 2 n`, ...
    queues: Vec<Receiver<Item<S>>>,
    threads: Vec<JoinHandle<()>>,
    turn: usize,
    spares: Arc<Spares<S::Batch>>,
}

/// Batches that are no longer needed.
type Spares<B> = Mutex<Vec<B>>;

type Item<S> =
    Result<StreamedBatch<<S as Source>::Batch>, DamagedBatch<StreamedBatch<<S as Source>::Batch>>>;

impl<S: Source> Stream<S> {
    /// Starts the threads.
    ///
    /// # Errors
    /// If a thread cannot be started.
    pub fn start(source: &Arc<S>, streaming: Streaming) -> Result<Self, ReadError> {
        let count = streaming.threads.get();
        let mut stream = Self {
            queues: Vec::with_capacity(count),
            threads: Vec::with_capacity(count),
            turn: 0,
            spares: Arc::default(),
        };
        for index in 0..count {
            let (sender, receiver) = sync_channel(streaming.ahead.max(1));
            let (source, spares) = (Arc::clone(source), Arc::clone(&stream.spares));
            let work = move || decode(&*source, streaming, index, (&sender, &spares));
            let thread = thread::Builder::new()
                .name(format!("decode-{index}"))
                .spawn(work)
                .map_err(|reason| {
                    ReadError::Other(format!("a thread for decoding cannot be started: {reason}"))
                })?;
            stream.queues.push(receiver);
            stream.threads.push(thread);
        }
        Ok(stream)
    }

    /// Takes a batch back whose values were copied elsewhere. The next one is decoded into its
    /// memory; without this a third of the reader's time goes into fresh memory.
    pub fn recycle(&self, batch: S::Batch) {
        if let Ok(mut spares) = self.spares.lock()
            && spares.len() < self.queues.len()
        {
            spares.push(batch);
        }
    }

    /// Waits for the threads, which have nothing more to do. One that panicked makes this one
    /// panic: batches would be missing otherwise.
    fn join(&mut self) {
        self.queues.clear();
        for thread in self.threads.drain(..) {
            if let Err(panic) = thread.join() {
                std::panic::resume_unwind(panic);
            }
        }
    }
}

impl<S: Source> Iterator for Stream<S> {
    type Item = Item<S>;

    fn next(&mut self) -> Option<Self::Item> {
        let queue = self.queues.get(self.turn)?;
        let Ok(item) = queue.recv() else {
            self.join();
            return None;
        };
        self.turn = (self.turn + 1) % self.queues.len();
        Some(item)
    }
}

impl<S: Source> Drop for Stream<S> {
    fn drop(&mut self) {
        // A thread that waits for a place in its queue ends when the queue is gone.
        self.queues.clear();
        for thread in self.threads.drain(..) {
            let _ = thread.join();
        }
    }
}

/// Makes every `threads`-th batch, from `index` on, until the receiver is gone.
fn decode<S: Source>(
    source: &S,
    streaming: Streaming,
    index: usize,
    (queue, spares): (&SyncSender<Item<S>>, &Spares<S::Batch>),
) {
    let Streaming {
        plan,
        from,
        until_epoch,
        threads,
        ..
    } = streaming;
    let jobs = plan.jobs(&source.turns(), from, until_epoch);
    for Job { samples, next } in jobs.skip(index).step_by(threads.get()) {
        let spare = spares.lock().ok().and_then(|mut spares| spares.pop());
        let (batch, damage) = source.batch(&samples, spare);
        let drawn = StreamedBatch { batch, next };
        let item = if damage.is_empty() {
            Ok(drawn)
        } else {
            let rest = drawn;
            Err(DamagedBatch { rest, damage })
        };
        if queue.send(item).is_err() {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reader::{Draw, Rank, ReadError};

    /// Turns whose samples are their own numbers; one of them is damaged.
    struct Numbers;

    impl Source for Numbers {
        type Batch = Vec<SampleId>;

        fn turns(&self) -> Vec<u32> {
            vec![50, 40]
        }

        fn batch(
            &self,
            samples: &[SampleId],
            _: Option<Vec<SampleId>>,
        ) -> (Vec<SampleId>, Vec<DamagedSample>) {
            let broken = SampleId {
                turn: 1,
                position: 7,
            };
            let (bad, good): (Vec<_>, Vec<_>) = samples.iter().partition(|&&id| id == broken);
            let damage = |_| DamagedSample {
                sample: "seven".to_owned(),
                fault: ReadError::Other("it is gone".to_owned()),
            };
            (good, bad.into_iter().map(damage).collect())
        }
    }

    fn streaming(threads: usize, from: Cursor, until_epoch: u64) -> Streaming {
        Streaming {
            plan: DrawPlan {
                batch: 12,
                draw: Draw::Neighbours,
                seed: Some(9),
                rank: Rank::ONLY,
            },
            from,
            until_epoch,
            threads: NonZeroUsize::new(threads).unwrap(),
            ahead: 2,
        }
    }

    fn drawn(threads: usize, from: Cursor) -> Vec<StreamedBatch<Vec<SampleId>>> {
        Stream::start(&Arc::new(Numbers), streaming(threads, from, 2))
            .unwrap()
            .map(|item| item.unwrap_or_else(|damaged| damaged.rest))
            .collect()
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let one = drawn(1, Cursor::default());
        assert_eq!(one.iter().map(|d| d.batch.len()).sum::<usize>(), 2 * 89);
        for threads in [2, 3, 7, 40] {
            assert_eq!(drawn(threads, Cursor::default()), one);
        }
    }

    #[test]
    fn a_stream_goes_on_behind_any_batch_of_another() {
        let whole = drawn(2, Cursor::default());
        for (at, drawn_before) in whole.iter().enumerate() {
            assert_eq!(drawn(3, drawn_before.next), whole[at + 1..]);
        }
    }

    #[test]
    fn a_damaged_sample_is_an_error_that_holds_the_rest() {
        let stream = Stream::start(&Arc::new(Numbers), streaming(2, Cursor::default(), 1)).unwrap();
        let damaged: Vec<_> = stream.filter_map(Result::err).collect();
        let [batch] = &damaged[..] else {
            panic!("{damaged:?}")
        };
        assert_eq!((batch.damage.len(), &*batch.damage[0].sample), (1, "seven"));
        for named in ["1 samples", "seven", "it is gone"] {
            assert!(batch.to_string().contains(named), "{named}: {batch}");
        }
        assert!(!batch.rest.batch.is_empty());
    }

    #[test]
    fn a_stream_without_an_end_stops_when_it_is_dropped() {
        let endless = streaming(3, Cursor::default(), u64::MAX);
        let mut stream = Stream::start(&Arc::new(Numbers), endless).unwrap();
        assert!(stream.by_ref().take(100).count() == 100);
        drop(stream);
    }

    #[test]
    fn a_source_without_samples_ends_at_once() {
        struct Nothing;
        impl Source for Nothing {
            type Batch = ();
            fn turns(&self) -> Vec<u32> {
                vec![0, 0]
            }
            fn batch(&self, _: &[SampleId], _: Option<()>) -> ((), Vec<DamagedSample>) {
                ((), Vec::new())
            }
        }
        let endless = streaming(2, Cursor::default(), u64::MAX);
        let mut stream = Stream::start(&Arc::new(Nothing), endless).unwrap();
        assert!(stream.next().is_none());
        assert!(stream.next().is_none());
    }
}
