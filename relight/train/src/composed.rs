//! From settings to composed samples.

use std::sync::Arc;

use tch::Kind;

use super::composer::Composition;
use super::decompose_task::Resources;
use super::error::TrainError;
use super::sample::TruthBatch;
use super::settings::{DataSettings, RunSettings};
use super::window::{SampleWindow, SampleWindowSettings};
use relight_reader::Share;
use relight_synth::{Folders, Library, Recipe, stream};

/// What samples are composed of, with the files that are named read.
///
/// # Errors
/// [`TrainError::Synth`].
pub(super) fn composition(data: &DataSettings, seed: u64) -> Result<Composition, TrainError> {
    let library = Library::read(&Folders {
        meshes: data.meshes.clone(),
        textures: data.textures.clone(),
        panoramas: data.panoramas.clone(),
    })?;
    Ok(Composition {
        recipe: Recipe {
            seed: stream(seed, 21),
            size: data.size,
            light: data.light,
            shadows: data.shadows,
            views: data.views,
            lightings: data.lightings,
            ..Recipe::default()
        },
        library,
        plain_share: data.plain_share,
    })
}

/// The batches of a run, composed while it trains.
#[derive(Debug)]
pub(super) struct ComposedBatches {
    composition: Arc<Composition>,
    settings: SampleWindowSettings,
    share: Share,
    kind: Kind,
    resources: Resources,
    /// Opened with the first batch, whose step says where.
    window: Option<SampleWindow>,
}

impl ComposedBatches {
    /// The batches of a composition, in 32 or 64 bits.
    pub(super) fn new(
        composition: Arc<Composition>,
        settings: SampleWindowSettings,
        kind: Kind,
        resources: Resources,
    ) -> Self {
        Self {
            composition,
            settings,
            share: Share::ALL,
            kind,
            resources,
            window: None,
        }
    }

    /// Leaves the rest of each batch to other processes. Called before the first batch.
    ///
    /// # Errors
    /// [`TrainError::Indivisible`].
    pub(super) fn take_share(&mut self, share: Share) -> Result<(), TrainError> {
        self.settings.check(share)?;
        self.share = share;
        Ok(())
    }

    /// The batch of a step; steps are asked for one after the other.
    pub(super) fn batch(&mut self, step: u64) -> Result<TruthBatch, TrainError> {
        let window = match self.window.take() {
            Some(window) => window,
            None => SampleWindow::open(
                self.settings,
                self.share,
                &self.composition,
                &self.resources,
                step,
            )?,
        };
        let window = self.window.insert(window);
        TruthBatch::new(&window.batch(step)?, self.kind, self.resources.device)
    }
}

/// How samples are drawn.
pub(super) fn window_settings(data: &DataSettings, run: &RunSettings) -> SampleWindowSettings {
    SampleWindowSettings {
        capacity: data.window,
        lightings: u64::from(data.lightings).max(1),
        reuse: data.reuse,
        batch: run.batch,
        seed: stream(run.seed, 22),
    }
}
