//! An object, and the object in a pose before the camera.

use serde::{Deserialize, Serialize};

use crate::lighting::SyntheticScene;
use crate::shape::ShapeKind;
use crate::view::{Pose, Projection};

/// Where an object comes from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObjectSource {
    /// A file of the library.
    Mesh {
        /// Its name.
        file: String,
    },
    /// A procedural shape.
    Shape {
        /// Its kind.
        kind: ShapeKind,
        /// Its seed.
        seed: u64,
    },
}

impl ObjectSource {
    /// The file's name without its extension, or the shape's kind.
    pub fn name(&self) -> String {
        match self {
            Self::Mesh { file } => match file.rsplit_once('.') {
                Some((stem, _)) => stem.to_owned(),
                None => file.clone(),
            },
            Self::Shape { kind, .. } => kind.name().to_owned(),
        }
    }
}

/// An object in its pose before the camera, ready to be lit.
pub struct SyntheticView {
    /// Where it comes from.
    pub object: ObjectSource,
    /// How it stands.
    pub(crate) pose: Pose,
    /// How it is seen.
    pub(crate) projection: Projection,
    /// The visible surface.
    pub scene: SyntheticScene,
}
