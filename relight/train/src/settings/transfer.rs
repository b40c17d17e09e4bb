//! What the network of turns learns from.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{ensure, within};
use crate::error::TrainError;

const MAX_VIEWS: u64 = 1_000_000;
// They stay in the device's memory, 5 MB each of 128 x 128.
const MAX_VALIDATION: u64 = 4096;

/// Views of objects on the table and rooms around them: the table `[data]` of `relight train turn`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TransferSettings {
    /// Width and height, a multiple of 32.
    pub size: u32,
    /// Views from which each step draws, at most.
    pub views: u64,
    /// Views that exist from the first step on.
    pub first_views: u64,
    /// New views cast at each step; once there are `views`, in place of the oldest.
    pub new_views: u64,
    /// Rays a pixel.
    pub rays: u32,
    /// Curves of brightness of each panorama.
    pub variants: u32,
    /// A folder of meshes, or the training part of a packed library, beside the procedural shapes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meshes: Option<PathBuf>,
    /// A folder of panoramas, or the training part of a packed library, in place of the synthetic ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub panoramas: Option<PathBuf>,
    /// A folder of panoramas, or the validation part of a packed library, to validate in; the synthetic ones where there is
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation_panoramas: Option<PathBuf>,
    /// Validation turns, of shapes that are not used in training.
    pub validation: u64,
}

impl Default for TransferSettings {
    fn default() -> Self {
        Self {
            size: 128,
            views: 768,
            first_views: 64,
            new_views: 1,
            rays: 144,
            variants: 8,
            meshes: None,
            panoramas: None,
            validation_panoramas: None,
            validation: 48,
        }
    }
}

impl TransferSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let is_right = (32..=512).contains(&self.size) && self.size.is_multiple_of(32);
        ensure(
            is_right,
            "data.size",
            self.size,
            "a multiple of 32 up to 512",
        )?;
        within("data.views", self.views, 1..=MAX_VIEWS)?;
        within("data.first_views", self.first_views, 1..=self.views)?;
        within("data.validation", self.validation, 1..=MAX_VALIDATION)?;
        within("data.new_views", self.new_views, 0..=MAX_VIEWS)?;
        within("data.rays", self.rays, 16..=4096)?;
        within("data.variants", self.variants, 1..=1000)
    }

    /// Whether batches of this size can be drawn: the samples of one are of different views.
    pub(crate) fn check_batch(&self, batch: u64) -> Result<(), TrainError> {
        let needed = format!("at least run.batch, {batch}");
        let views = self.first_views;
        ensure(views >= batch, "data.first_views", views, &needed)
    }

    /// The views that a step draws from, by their numbers: the oldest, and the first that is not one of them.
    pub(crate) fn views_at(&self, step: u64) -> (u64, u64) {
        let joined = self.new_views.saturating_mul(step);
        let end = self.first_views.saturating_add(joined);
        (end.saturating_sub(self.views), end)
    }
}
