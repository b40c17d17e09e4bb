//! The samples that a network is being trained on: a window that moves on over the composed ones.
//!
//! Composing costs more than looking at a sample again. Each stays for a while, batches draw from the
//! whole window, and on the way each is seen `reuse` times in the mean.

use std::sync::Arc;

use super::composer::{Composer, Composition, unit};
use super::error::TrainError;
use super::sample::TruthArrays;
use crate::synth::stream;

/// How samples are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleWindowSettings {
    /// Samples that are kept.
    pub capacity: u64,
    /// How often each is seen, in the mean.
    pub reuse: f64,
    /// Samples of a batch.
    pub batch: u64,
    /// Of the draws.
    pub seed: u64,
}

/// The window.
#[derive(Debug)]
pub struct SampleWindow {
    settings: SampleWindowSettings,
    composer: Composer,
    /// The number of the sample that will be taken in next; sample n lies at n modulo the capacity.
    next: u64,
    samples: Vec<TruthArrays>,
}

impl SampleWindow {
    /// The window of the batch `step`: the samples before it are composed, which takes a while. `threads` compose.
    ///
    /// # Errors
    /// Those of the composer.
    pub fn open(
        settings: SampleWindowSettings,
        composition: &Arc<Composition>,
        threads: usize,
        step: u64,
    ) -> Result<Self, TrainError> {
        let lightings = u64::from(composition.recipe.lightings).max(1);
        let (oldest, capacity) = (settings.taken_before(step), settings.capacity);
        let view = oldest / lightings;
        let mut composer = Composer::start(Arc::clone(composition), view, threads)?;
        for _ in view * lightings..oldest {
            composer.next_sample()?;
        }
        let mut samples = (0..capacity)
            .map(|_| composer.next_sample())
            .collect::<Result<Vec<_>, _>>()?;
        samples.rotate_right((oldest % capacity) as usize);
        Ok(Self {
            settings,
            composer,
            next: oldest + capacity,
            samples,
        })
    }

    /// The samples of the batch `step`; batches are asked for one after the other.
    ///
    /// # Errors
    /// Those of the composer.
    pub fn batch(&mut self, step: u64) -> Result<Vec<&TruthArrays>, TrainError> {
        let SampleWindowSettings {
            capacity,
            batch,
            seed,
            ..
        } = self.settings;
        while self.next < capacity + self.settings.taken_before(step) {
            let place = (self.next % capacity) as usize;
            self.samples[place] = self.composer.next_sample()?;
            self.next += 1;
        }
        let draw = |number: u64| {
            let hash = stream(stream(seed, step), number);
            (unit(hash) * capacity as f64) as usize
        };
        Ok((0..batch).map(|k| &self.samples[draw(k)]).collect())
    }
}

impl SampleWindowSettings {
    /// How many samples the window has moved on before a step.
    fn taken_before(self, step: u64) -> u64 {
        (step as f64 * self.batch as f64 / self.reuse) as u64
    }
}
