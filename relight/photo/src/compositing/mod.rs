//! Objects in another picture, with their shadows: a scene as text, the light and ground of its background, and the
//! picture of it. Knows neither files nor terminals.
//!
//! | file | concern |
//! | --- | --- |
//! | `description` | a scene as a text in TOML |
//! | `scene_environment` | what a background determines: light, size, tilt of the ground, brightness |
//! | `scene`, `scene_object`, `layer` | objects in a new picture |
//! | `shadow` | what an object keeps from the ground |
//! | `harmonisation` | brightness, white balance and grain of a background |

mod description;
mod harmonisation;
mod layer;
mod scene;
mod scene_environment;
mod scene_object;
mod shadow;

pub use description::{LightDescription, ObjectDescription, SceneDescription};
pub use harmonisation::Harmonisation;
pub use layer::SceneLayer;
pub use scene::InsertScene;
pub use scene_environment::{SceneBackground, SceneEnvironment};
pub use scene_object::SceneObject;
