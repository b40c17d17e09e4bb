//! What a network learns from: synthetic samples and turns.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{ensure, within};
use crate::error::TrainError;

// Nobody trains more: these keep a slip of the pen from filling the memory.
const MAX_SAMPLES: u64 = 1_000_000;
const MAX_SIZE: u32 = 1024;
// Turns to validate on stay in the device's memory, 5 MB each of 128 x 128.
const MAX_VALIDATION: u64 = 4096;

/// Views of objects and rooms around them: the table `[data]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DataSettings {
    /// Width and height of the pictures, a multiple of 32.
    pub size: u32,
    /// Views from which each step draws, at most.
    pub views: u64,
    /// Views that exist from the first step on, by default all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first_views: Option<u64>,
    /// New views cast at each step; once there are `views`, in place of the oldest.
    pub new_views: u64,
    /// Rays a pixel of a view.
    pub rays: u32,
    /// A folder of meshes, or the training part of a packed library, beside the procedural shapes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meshes: Option<PathBuf>,
    /// A folder of panoramas, or the training part of a packed library, in place of the synthetic ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub panoramas: Option<PathBuf>,
    /// For turns, a folder of panoramas, or the validation part of a packed library, to validate in; the synthetic ones where
    /// there is none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub validation_panoramas: Option<PathBuf>,
    /// Validation samples, from seeds that are not used in training.
    pub validation: u64,
}

impl Default for DataSettings {
    fn default() -> Self {
        Self {
            size: 128,
            views: 256,
            first_views: None,
            new_views: 1,
            rays: 128,
            meshes: None,
            panoramas: None,
            validation_panoramas: None,
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
        within("data.first_views", self.first_views(), 1..=self.views)?;
        within("data.new_views", self.new_views, 0..=MAX_SAMPLES)?;
        within("data.rays", self.rays, 16..=4096)?;
        within("data.validation", self.validation, 1..=MAX_VALIDATION)
    }

    /// The same for the networks of photographs, which are validated in the panoramas that they are trained in.
    pub(crate) fn check_photographs(&self) -> Result<(), TrainError> {
        let path = self.validation_panoramas.as_ref();
        let value = path.map_or(String::new(), |path| path.display().to_string());
        ensure(
            path.is_none(),
            "data.validation_panoramas",
            value,
            "left out but for turns",
        )?;
        self.check()
    }

    /// Whether batches of this size can be drawn: the samples of one are of different views.
    pub(crate) fn check_batch(&self, batch: u64) -> Result<(), TrainError> {
        let (needed, views) = (format!("at least run.batch, {batch}"), self.first_views());
        let name = match self.first_views {
            Some(_) => "data.first_views",
            None => "data.views",
        };
        ensure(views >= batch, name, views, &needed)
    }

    fn first_views(&self) -> u64 {
        self.first_views.unwrap_or(self.views)
    }

    /// The views that a step draws from, by their numbers: the oldest, and the first that is not one of them.
    pub(crate) fn views_at(&self, step: u64) -> (u64, u64) {
        let joined = self.new_views.saturating_mul(step);
        let end = self.first_views().saturating_add(joined);
        (end.saturating_sub(self.views), end)
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
