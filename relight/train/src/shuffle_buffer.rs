//! The shuffle buffer: the samples that batches are drawn from. It moves on over the composed ones.
//!
//! Composing costs more than looking at a sample again. Each stays for a while, batches draw from the
//! whole buffer, and on the way each is seen `reuse` times in the mean.
//!
//! The samples of a batch come from different views: view n is of class n modulo the number of classes, and so is each
//! draw. Where several processes share the batches, each has some of the classes, composes their views only, and makes
//! their draws; all draws together are those of one process.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::data_loader::{Composition, DataLoader, NOT_COMPOSED, unit};
use super::error::TrainError;
use super::process_group::indivisible;
use super::sample::{DrawnSample, TruthArrays};
use super::symmetry::Symmetry;
use super::task::Resources;
use relight_core::reader::Rank;
use relight_synth::stream;

/// How samples are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ShuffleBufferSettings {
    /// Samples that are kept.
    pub capacity: u64,
    /// Samples of a view, at least 1.
    pub lightings: u64,
    /// How often each is seen, in the mean.
    pub reuse: f64,
    /// Samples of a batch.
    pub batch: u64,
    /// Of the draws.
    pub seed: u64,
}

/// A sample of a batch by its number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct SampleDraw {
    number: u64,
    symmetry: Symmetry,
}

/// The buffer.
#[derive(Debug)]
pub(crate) struct ShuffleBuffer {
    settings: ShuffleBufferSettings,
    rank: Rank,
    loader: DataLoader,
    samples: BTreeMap<u64, TruthArrays>,
    /// The sample behind the buffer.
    next: Option<(u64, TruthArrays)>,
}

impl ShuffleBuffer {
    /// The buffer of the batch `step`: the samples before it are composed, which takes a while.
    ///
    /// # Errors
    /// Those of the loader; [`TrainError::Stopped`] where a run of one process is asked to stop meanwhile.
    pub(crate) fn open(
        settings: ShuffleBufferSettings,
        rank: Rank,
        composition: &Arc<Composition>,
        resources: &Resources,
        step: u64,
    ) -> Result<Self, TrainError> {
        let view = settings.taken_before(step) / settings.lightings;
        let mut buffer = Self {
            settings,
            rank,
            loader: DataLoader::start(Arc::clone(composition), rank, view, resources.workers)?,
            samples: BTreeMap::new(),
            next: None,
        };
        // The other processes of a group wait for this one's first step.
        let stop = (rank == Rank::ONLY).then_some(resources.stop.as_ref());
        buffer.move_to(step, stop)?;
        Ok(buffer)
    }

    /// This process's samples of the batch `step`; batches are asked for one after the other.
    ///
    /// # Errors
    /// Those of the loader.
    pub(crate) fn batch(&mut self, step: u64) -> Result<Vec<DrawnSample<'_>>, TrainError> {
        self.move_to(step, None)?;
        let draws = self.settings.draws(step, self.rank);
        draws
            .map(|draw| {
                let arrays = self.samples.get(&draw.number).ok_or(NOT_COMPOSED)?;
                let symmetry = draw.symmetry;
                Ok(DrawnSample { arrays, symmetry })
            })
            .collect()
    }

    fn move_to(&mut self, step: u64, stop: Option<&AtomicBool>) -> Result<(), TrainError> {
        let oldest = self.settings.taken_before(step);
        loop {
            if stop.is_some_and(|stop| stop.load(Ordering::Relaxed)) {
                return Err(TrainError::Stopped);
            }
            let (number, sample) = match self.next.take() {
                Some(next) => next,
                None => self.loader.next_sample()?,
            };
            if number >= oldest + self.settings.capacity {
                self.next = Some((number, sample));
                break;
            }
            self.samples.insert(number, sample);
        }
        self.samples = self.samples.split_off(&oldest);
        Ok(())
    }
}

impl ShuffleBufferSettings {
    /// Whether batches can be divided so.
    ///
    /// # Errors
    /// [`TrainError::Refused`].
    pub(crate) fn check(self, rank: Rank) -> Result<(), TrainError> {
        let of = rank.world_size();
        if !self.batch.is_multiple_of(u64::from(of)) {
            let needed = format!("a multiple of {of}");
            return Err(indivisible("run.batch", self.batch, rank, &needed));
        }
        if !self.classes().is_multiple_of(u64::from(of)) {
            let least = self.batch * self.lightings;
            let needed = format!("at least run.batch x data.lightings, {least}");
            let (name, capacity) = ("data.shuffle_buffer", self.capacity);
            return Err(indivisible(name, capacity, rank, &needed));
        }
        Ok(())
    }

    /// How many samples the buffer has moved on before a step.
    fn taken_before(self, step: u64) -> u64 {
        (step as f64 * self.batch as f64 / self.reuse) as u64
    }

    /// As many as samples of a batch, but no more than views that are always in the buffer.
    fn classes(self) -> u64 {
        self.batch.min(self.capacity / self.lightings).max(1)
    }

    /// A process's part of a batch, in the order of the whole batch.
    fn draws(self, step: u64, rank: Rank) -> impl Iterator<Item = SampleDraw> {
        let own = u64::from(rank.index())..self.batch;
        own.step_by(rank.world_size() as usize).map(move |place| {
            let hash = stream(stream(self.seed, step), place);
            SampleDraw {
                number: self.pick(step, place % self.classes(), unit(hash)),
                // The bits above make the part.
                symmetry: Symmetry::of_bits(hash),
            }
        })
    }

    /// The sample of a class at a part, 0..1, of those in the buffer.
    fn pick(self, step: u64, class: u64, part: f64) -> u64 {
        let (oldest, lightings) = (self.taken_before(step), self.lightings);
        let behind = oldest + self.capacity;
        let first = oldest / lightings;
        let classes = self.classes();
        let first = first + (class + classes - first % classes) % classes;
        let views = (first..behind.div_ceil(lightings)).step_by(classes as usize);
        let samples = views.map(|view| {
            let begin = (view * lightings).max(oldest);
            begin..((view + 1) * lightings).min(behind)
        });
        let count: u64 = samples.clone().map(|range| range.end - range.start).sum();
        let mut at = (part * count as f64) as u64;
        for range in samples {
            let length = range.end - range.start;
            if at < length {
                return range.start + at;
            }
            at -= length;
        }
        // Rounding: the part is below 1, and no class is empty.
        behind - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    const SETTINGS: ShuffleBufferSettings = ShuffleBufferSettings {
        capacity: 53,
        lightings: 3,
        reuse: 2.5,
        batch: 12,
        seed: 7,
    };

    fn draws(settings: ShuffleBufferSettings, step: u64, rank: Rank) -> Vec<SampleDraw> {
        settings.draws(step, rank).collect()
    }

    #[test]
    fn what_processes_draw_together_one_draws_alone() {
        for step in 0..200 {
            let whole = draws(SETTINGS, step, Rank::ONLY);
            for of in [2, 3, 4, 6, 12] {
                let mut merged = vec![None; whole.len()];
                for index in 0..of {
                    let rank = Rank::new(index, of).unwrap();
                    let own = draws(SETTINGS, step, rank);
                    assert_eq!(own.len(), whole.len() / of as usize);
                    for (at, draw) in own.into_iter().enumerate() {
                        let view = draw.number / SETTINGS.lightings;
                        assert_eq!(view % u64::from(of), u64::from(index));
                        merged[index as usize + at * of as usize] = Some(draw);
                    }
                }
                let merged: Vec<SampleDraw> = merged.into_iter().flatten().collect();
                assert_eq!(merged, whole);
            }
        }
    }

    #[test]
    fn batches_are_of_different_views_in_the_buffer_and_see_all_samples_as_often() {
        let mut seen = BTreeMap::new();
        for step in 0..4000 {
            let oldest = SETTINGS.taken_before(step);
            let drawn = draws(SETTINGS, step, Rank::ONLY);
            let views: BTreeSet<u64> = drawn.iter().map(|d| d.number / 3).collect();
            assert_eq!(views.len(), 12);
            for draw in drawn {
                assert!((oldest..oldest + SETTINGS.capacity).contains(&draw.number));
                *seen.entry(draw.number).or_insert(0_u32) += 1;
            }
        }
        let settled = 100..SETTINGS.taken_before(4000);
        // Some are never drawn: they count as well.
        let count = (settled.end - settled.start) as f64;
        let times: u32 = seen.range(settled).map(|(_, times)| times).sum();
        assert!((f64::from(times) / count - 2.5).abs() < 0.05);
    }

    #[test]
    fn what_cannot_be_divided_is_named() {
        let check = |settings: ShuffleBufferSettings, of| settings.check(Rank::new(0, of).unwrap());
        assert!(check(SETTINGS, 4).is_ok());
        let error = check(SETTINGS, 5).unwrap_err().to_string();
        assert!(error.contains("run.batch is 12"), "{error}");
        let narrow = ShuffleBufferSettings {
            capacity: 20,
            ..SETTINGS
        };
        assert!(narrow.check(Rank::ONLY).is_ok());
        let error = check(narrow, 4).unwrap_err().to_string();
        assert!(
            error.contains("data.shuffle_buffer is 20") && error.contains("36"),
            "{error}"
        );
    }
}
