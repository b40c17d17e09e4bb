//! What a network learns from: composed samples and turns.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use super::{ensure, within};
use crate::error::TrainError;

// Nobody trains more: these keep a slip of the pen from filling the memory.
const MOST_SAMPLES: u64 = 1_000_000;
const LARGEST_SIZE: u32 = 1024;

/// What samples are composed of: the table `[data]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DataSettings {
    /// Width and height of the pictures, a multiple of 32.
    pub size: u32,
    /// Views of each object.
    pub views: u32,
    /// Materials and lightings of each view.
    pub lightings: u32,
    /// Samples of the shuffle buffer, from which batches are drawn.
    pub shuffle_buffer: u64,
    /// How often each is seen, in the mean.
    pub reuse: f64,
    /// A folder of meshes, or the training part of a packed library, beside the procedural shapes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meshes: Option<PathBuf>,
    /// A folder of pictures to lay onto objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub textures: Option<PathBuf>,
    /// A folder of panoramas, or the training part of a packed library, in place of the synthetic ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub panoramas: Option<PathBuf>,
    /// Samples on which the network is validated, made from seeds that it does not train on.
    pub validation: u64,
}

impl Default for DataSettings {
    fn default() -> Self {
        Self {
            size: 128,
            views: 2,
            lightings: 6,
            shuffle_buffer: 768,
            reuse: 4.0,
            meshes: None,
            textures: None,
            panoramas: None,
            validation: 48,
        }
    }
}

/// What a step takes from turns: the table `[turns]`.
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
    /// Whether all numbers are in range; the recipe checks the others.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        let is_right = (32..=LARGEST_SIZE).contains(&self.size) && self.size.is_multiple_of(32);
        ensure(
            is_right,
            "data.size",
            self.size,
            "a multiple of 32 up to 1024",
        )?;
        within("data.shuffle_buffer", self.shuffle_buffer, 1..=MOST_SAMPLES)?;
        within("data.reuse", self.reuse, 1.0..=1e6)?;
        within("data.validation", self.validation, 1..=MOST_SAMPLES)
    }
}

impl TurnSettings {
    /// Whether all numbers are in range.
    ///
    /// # Errors
    /// [`TrainError::Refused`] names the first that is not.
    pub fn check(&self) -> Result<(), TrainError> {
        within("turns.groups", self.groups, 1..=MOST_SAMPLES)
    }
}
