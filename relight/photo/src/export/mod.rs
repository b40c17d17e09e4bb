//! Captured objects, decompositions and turns as files that other programs read.
//!
//! | module | concern |
//! | --- | --- |
//! | `source` | an object out of `object.relit`, or a folder of `relight turn` or `relight decompose` |
//! | `heights` | heights out of normals, by least squares |
//! | `mesh` | a relief with the object's outline |
//! | `glb` | the mesh with its material as one binary glTF file |
//! | `layers` | all maps as layers of one EXR file |
//!
//! Axes are those of all of relight, which are glTF's too: x to the right, y up, z to the viewer.

mod glb;
mod heights;
mod layers;
mod mesh;
mod source;

use std::fmt::Display;

use relight_core::image::ImageError;

pub use glb::to_glb;
pub use layers::to_layers;
pub use mesh::ObjectMesh;
pub use source::{is_object, object_files, read_object};

/// That an object does not fit into a file.
fn not_encoded(fault: impl Display) -> ImageError {
    ImageError::Other(format!("the object cannot be encoded: {fault}"))
}
