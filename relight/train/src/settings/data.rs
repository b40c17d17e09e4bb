//! What a network learns from: synthetic samples and turns.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{ensure, within};
use crate::error::TrainError;

// Nobody trains more: these keep a slip of the pen from filling the memory.
const MAX_SAMPLES: u64 = 1_000_000;
const MAX_SIZE: u32 = 1024;

/// The data of photographs: the table `[data]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DataSettings {
    /// Width and height of the pictures, a multiple of 32.
    pub size: u32,
    /// Views from which each step draws.
    pub views: u64,
    /// New views cast at each step, in place of the oldest.
    pub new_views: u64,
    /// Rays a pixel of a view.
    pub rays: u32,
    /// Curves of brightness of each panorama.
    pub variants: u32,
    /// A folder of meshes, or the training part of a packed library, beside the procedural shapes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meshes: Option<PathBuf>,
    /// A folder of pictures to lay onto objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub textures: Option<PathBuf>,
    /// A folder of panoramas, or the training part of a packed library, in place of the synthetic ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub panoramas: Option<PathBuf>,
    /// Validation samples, from seeds that are not used in training.
    pub validation: u64,
}

impl Default for DataSettings {
    fn default() -> Self {
        Self {
            size: 128,
            views: 256,
            new_views: 1,
            rays: 128,
            variants: 8,
            meshes: None,
            textures: None,
            panoramas: None,
            validation: 48,
        }
    }
}

/// The turns of a step: the table `[turns]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TurnSettings {
    /// Groups of a step, at least 1, each of 12 frames of one turn.
    pub groups: u64,
}

impl Default for TurnSettings {
    fn default() -> Self {
        Self { groups: 1 }
    }
}

impl DataSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let is_right = (32..=MAX_SIZE).contains(&self.size) && self.size.is_multiple_of(32);
        ensure(
            is_right,
            "data.size",
            self.size,
            "a multiple of 32 up to 1024",
        )?;
        within("data.views", self.views, 1..=MAX_SAMPLES)?;
        within("data.new_views", self.new_views, 0..=MAX_SAMPLES)?;
        within("data.rays", self.rays, 16..=4096)?;
        within("data.variants", self.variants, 1..=1000)?;
        within("data.validation", self.validation, 1..=MAX_SAMPLES)
    }

    /// Whether batches of this size can be drawn: the samples of one are of different views.
    pub(crate) fn check_batch(&self, batch: u64) -> Result<(), TrainError> {
        let needed = format!("at least run.batch, {batch}");
        ensure(self.views >= batch, "data.views", self.views, &needed)
    }

    /// How many views have been cast when a step draws.
    pub(crate) fn views_at(&self, step: u64) -> u64 {
        let joined = self.new_views.saturating_mul(step);
        self.views.saturating_add(joined)
    }
}

impl TurnSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        within("turns.groups", self.groups, 1..=MAX_SAMPLES)
    }
}
