//! From settings to composed samples.

use super::composer::Composition;
use super::error::TrainError;
use super::settings::{DataSettings, RunSettings};
use super::window::SampleWindowSettings;
use crate::synth::{Folders, Library, Recipe, stream};

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
            views: data.views,
            lightings: data.lightings,
            ..Recipe::default()
        },
        library,
        plain_share: data.plain_share,
    })
}

/// How samples are drawn.
pub(super) fn window_settings(data: &DataSettings, run: &RunSettings) -> SampleWindowSettings {
    SampleWindowSettings {
        capacity: data.window,
        reuse: data.reuse,
        batch: run.batch,
        seed: stream(run.seed, 22),
    }
}
