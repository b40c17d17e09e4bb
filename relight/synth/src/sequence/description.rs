//! The inputs of turns and the ground truth of their frames, as in files.

use serde::{Deserialize, Serialize};

use crate::lighting::Lighting;
use crate::samples::camera::CameraModel;
use crate::samples::finish::Finish;
use crate::samples::object::ObjectSource;
use crate::samples::recipe::Recipe;
use crate::samples::sample::WhiteLevels;
use crate::view::{Pose, Projection};

/// How turns are made.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SequenceRecipe {
    /// Seed, size, light and shadows; its camera is sRGB without noise or compression.
    pub recipe: Recipe,
    /// Frames a turn, 1..=1 000 000.
    pub frames: u32,
}

/// The inputs of a turn, as in `turn.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SequenceDescription {
    /// `relight.turn/1`.
    pub(crate) schema: String,
    /// The seed of its draws: the recipe's seed and the turn's number.
    pub(crate) seed: u64,
    /// The turn's number.
    pub(crate) number: u64,
    /// The object.
    pub(crate) object: ObjectSource,
    /// How it stands.
    pub(crate) pose: Pose,
    /// How it is seen.
    pub(crate) projection: Projection,
    /// The table's axis in the viewer's frame, upwards. At the table's angle `a`, the light has turned by
    /// `-a` about it (right-hand rule).
    pub axis: [f64; 3],
    /// The object's finish.
    pub(crate) finish: Finish,
    /// The name of the panorama that the lighting has.
    pub(crate) panorama: Option<String>,
    /// The light at the angle 0.
    pub(crate) lighting: Lighting,
    /// The camera.
    pub(crate) camera: CameraModel,
    /// Frames.
    pub(crate) frames: u32,
    /// Width and height.
    pub(crate) size: u32,
}

/// The ground truth of one frame, a line of `frames.jsonl`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FrameTruth {
    /// The sample's index.
    pub index: u32,
    /// The table's angle, degrees.
    pub angle_deg: f64,
    /// The value of 65535 in the frame's `shading` and `highlight`.
    pub(crate) white: WhiteLevels,
    /// All light but what bounces, as nine coefficients in the viewer's frame, with the camera's gain.
    pub coefficients: [[f64; 3]; 9],
}
