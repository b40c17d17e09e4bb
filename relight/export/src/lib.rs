//! Captured objects, decompositions and turns as files that other programs read. Knows no networks and no terminals.
//!
//! | module | concern |
//! | --- | --- |
//! | [`source`] | an object out of `object.relit`, or a folder of `relight turn` or `relight decompose` |
//! | [`heights`] | heights out of normals, by least squares |
//! | [`mesh`] | a plane or a relief with the object's outline |
//! | [`glb`] | the mesh with its material as one binary glTF file |
//! | [`layers`] | all maps as layers of one EXR file |
//! | [`blender`] | a script that sets up object, light and camera in Blender |
//! | [`frames`] | frames of a turn with their mask, as methods of photometric stereo read them |
//! | [`lamp`] | where the light comes from, frame by frame, where one lamp dominates |
//!
//! Axes are those of all of relight, which are glTF's too: x to the right, y up, z to the viewer.

pub mod blender;
mod error;
pub mod frames;
pub mod glb;
pub mod heights;
pub mod lamp;
pub mod layers;
pub mod mesh;
pub mod source;

pub use error::ExportError;
