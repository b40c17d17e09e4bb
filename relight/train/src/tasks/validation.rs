//! Validation during training: on turns and synthetic samples that no network trains on.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;

use rayon::prelude::*;
use tch::{Device, Kind, Tensor, no_grad};

use super::low_rank::rank_one;
use super::paper_phases::equal_rows;
use crate::data::sample::{Linearisation, TruthArrays, TruthBatch};
use crate::data::turn_reader::{TurnReader, TurnTensors, no_frames};
use crate::error::TrainError;
use relight_synth::{Library, Recipe, stream};

/// Batches of turns that are kept.
const TURN_BATCHES: usize = 4;
/// Samples of a batch of synthetic samples.
const SAMPLE_BATCH: usize = 16;
/// Part of the pictures whose values are read as sRGB, whatever the camera's response.
const TAKEN_AS_SRGB: f64 = 0.10;
/// Part of the pictures that a plain camera takes (sRGB, no noise, no compression); the others follow the recipe.
const PLAIN: f64 = 0.5;
/// The least part of white that counts as a highlight.
const SEEN_HIGHLIGHT: f64 = 0.05;

/// Figures by name, each a mean over what was looked at.
pub(crate) type Figures = BTreeMap<String, f64>;

/// Batches of 12 frames of turns: the first of a fixed order, so that runs can be compared.
#[derive(Debug)]
pub(crate) struct ValidationTurns {
    batches: Vec<TurnTensors>,
    /// The damage in them, until it is reported.
    damage: Option<String>,
}

impl ValidationTurns {
    /// Reads the batches of a data set.
    pub(crate) fn read(path: &Path, kind: Kind, device: Device) -> Result<Self, TrainError> {
        let mut reader = TurnReader::open(path, stream(0x74_75_72_6e, 23))?;
        let (mut batches, mut damage) = (Vec::with_capacity(TURN_BATCHES), Vec::new());
        while batches.len() < TURN_BATCHES && reader.cursor().epoch == 0 {
            let group = reader.next_group(kind, device)?;
            batches.extend(group.frames);
            damage.extend(group.damage);
        }
        if batches.is_empty() {
            return Err(no_frames());
        }
        let damage = (!damage.is_empty()).then(|| format!("held out: {}", damage.join("; ")));
        Ok(Self { batches, damage })
    }

    /// What was damaged, once.
    pub(crate) fn take_damage(&mut self) -> Option<String> {
        self.damage.take()
    }

    /// The mean of each figure over the batches that have it.
    pub(crate) fn figures(
        &self,
        of: impl Fn(&TurnTensors) -> Result<Vec<(&'static str, f64)>, TrainError>,
    ) -> Result<Figures, TrainError> {
        let mut sums: BTreeMap<&str, (f64, f64)> = BTreeMap::new();
        for batch in &self.batches {
            for (name, value) in no_grad(|| of(batch))? {
                let sum = sums.entry(name).or_default();
                *sum = (sum.0 + value, sum.1 + 1.0);
            }
        }
        let mean = |(name, (sum, count)): (&str, (f64, f64))| (name.to_owned(), sum / count);
        Ok(sums.into_iter().map(mean).collect())
    }
}

/// Ray-cast samples of objects that are never trained on, all procedural.
#[derive(Debug)]
pub(crate) struct ValidationSamples {
    recipe: Recipe,
    library: Library,
    count: u64,
    /// Made at their first use, in one process only.
    samples: OnceLock<Vec<TruthArrays>>,
}

impl ValidationSamples {
    /// One sample each of `count` objects of a size. Neither their seed nor their light depends on the run's, so that runs
    /// can be compared.
    pub(crate) fn new(library: &Library, size: u32, count: u64) -> Self {
        Self {
            recipe: Recipe {
                seed: stream(0x76_61_6c, 23),
                size,
                views: 1,
                lightings: 1,
                ..Recipe::default()
            },
            library: library.without_meshes(),
            count,
            samples: OnceLock::new(),
        }
    }

    fn samples(&self) -> &[TruthArrays] {
        let made = |number| self.sample(number);
        self.samples
            .get_or_init(|| (0..self.count).into_par_iter().map(made).collect())
    }

    fn sample(&self, number: u64) -> TruthArrays {
        let draw = |which: u64| unit(stream(stream(self.recipe.seed, which), number));
        let recipe = Recipe {
            random_camera: draw(11) >= PLAIN,
            ..self.recipe.clone()
        };
        let linearisation = if draw(12) < TAKEN_AS_SRGB {
            Linearisation::AsSrgb
        } else {
            Linearisation::Exact
        };
        let (object, mesh) = recipe.object(&self.library, number);
        let seen = recipe.view(&object, &mesh, number);
        TruthArrays::new(&recipe.sample(&self.library, &seen, number), linearisation)
    }

    /// The mean of each figure over the samples.
    pub(crate) fn figures(
        &self,
        kind: Kind,
        device: Device,
        mut of: impl FnMut(&TruthBatch) -> Result<Vec<(&'static str, f64)>, TrainError>,
    ) -> Result<Figures, TrainError> {
        let mut sums = Figures::new();
        for samples in self.samples().chunks(SAMPLE_BATCH) {
            let share = samples.len() as f64 / self.samples().len() as f64;
            let batch = TruthBatch::new(samples, kind, device);
            for (name, value) in no_grad(|| of(&batch))? {
                *sums.entry(name.to_owned()).or_default() += share * value;
            }
        }
        Ok(sums)
    }
}

/// A hash as a number in 0..1.
fn unit(hash: u64) -> f64 {
    (hash >> 11) as f64 / (1_u64 << 53) as f64
}

/// How far pictures of one reflectance, `frames x channels x height x width`, are from being multiples of one: the
/// part of their energy that the best matrix of rank one leaves. Frames are brought to one length first.
pub(crate) fn rank_residual(of: &Tensor, mask: &Tensor) -> Result<f64, TrainError> {
    let rows = equal_rows(of, mask);
    let energy = |of: &Tensor| of.square().sum(Kind::Double);
    let rest = energy(&(&rows - rank_one(&rows)));
    let residual = &rest / energy(&rows).clamp_min(1e-12);
    Ok(f64::try_from(residual)?)
}

/// How well highlights are found: the energy of the error as a part of theirs, and which part of the pixels that were
/// found and of those that there are is right.
pub(crate) fn highlight_figures(
    found: &Tensor,
    batch: &TruthBatch,
) -> Result<[(&'static str, f64); 3], TrainError> {
    let (truth, mask) = (&batch.highlight, &batch.mask);
    let energy = |of: &Tensor| f64::try_from((of * mask).square().sum(Kind::Double));
    let seen = |of: &Tensor| (of * mask).gt(SEEN_HIGHLIGHT);
    let (found_there, truly_there) = (seen(found), seen(truth));
    let count = |of: &Tensor| f64::try_from(of.sum(Kind::Double));
    let right = count(&found_there.logical_and(&truly_there))?;
    Ok([
        (
            "highlight",
            energy(&(found - truth))? / energy(truth)?.max(1e-9),
        ),
        ("highlight_precision", right / count(&found_there)?.max(1.0)),
        ("highlight_recall", right / count(&truly_there)?.max(1.0)),
    ])
}
