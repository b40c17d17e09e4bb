//! Synthetic pictures of objects together with their ground truth: data to warm networks up with, and to judge them by.
//!
//! | module | concern |
//! | --- | --- |
//! | `mesh`, `shape` | triangles from files, and out of nothing but a seed |
//! | `geometry` | what a camera sees of them, which light is blocked |
//! | `paint`, `texture` | albedo and relief; pictures that are laid onto objects |
//! | `lighting` | lamps and panoramas on what is seen; `studio` makes panoramas out of nothing but a seed |
//! | `samples` | `recipe` draws objects, `view`s, `finish`es and lights; `camera` makes 8-bit values of light; `folder` writes |
//! | `library`, `pack` | what there is to draw from; many objects and panoramas in one file |
//! | `sequence` | whole turns as shards |
//! | `transfer` | views for any environment light without rays: of photographs and of whole turns |
//!
//! All of it follows from a seed: the same seed gives the same bytes on any number of threads. What is
//! slow is kept apart from what is cheap: a [`SyntheticScene`] is made once for an object in a pose, and then
//! lit as often as one likes.
//!
//! ```
//! use relight_synth::{Folders, Library, Recipe};
//!
//! let library = Library::read(&Folders::default())?;
//! let recipe = Recipe { size: 32, ..Recipe::default() };
//! let (object, mesh) = recipe.object(&library, 0);
//! let view = recipe.view(&object, &mesh, 1);
//! let sample = recipe.sample(&library, &view, 2);
//! assert_eq!(sample.image.width(), 32);
//! # Ok::<(), relight_synth::SynthError>(())
//! ```

mod error;
mod geometry;
mod library;
mod lighting;
mod mesh;
mod noise;
mod pack;
mod paint;
mod random;
mod samples;
mod sequence;
mod shape;
mod texture;
mod transfer;
mod vectors;
pub(crate) mod view;

pub use error::SynthError;
pub use geometry::GBuffer;
pub use library::{Folders, Library, SkippedFile, made_panoramas};
pub use lighting::{BlinnPhong, LightKind, Lighting, Material, Panoramas, Shaded, SyntheticScene};
pub use mesh::Mesh;
pub use pack::{
    LIBRARY_EXTENSION, LibraryEntry, LibrarySources, LibrarySummary, build_library, is_packed,
};
pub use random::{normal_of, stream};
pub use samples::folder::{SampleFolder, SynthSummary, write_samples};
pub use samples::object::{ObjectSource, SyntheticView};
pub use samples::recipe::Recipe;
pub use samples::sample::SynthSample;
pub use sequence::{FrameTruth, SequenceDescription, SequenceRecipe, write_sequences};
pub use shape::ShapeKind;
pub use transfer::{
    CURVE_TERMS, CurveTerms, EnvironmentLights, PhotoCamera, PhotoGloss, PhotoLamp, PhotoPlan,
    PhotoPrint, PhotoView, TurnMaterial, TurnPlan, TurnView, ViewLamp, ViewRecipe,
};
