//! Objects out of photographs in another light, and in other pictures. Knows neither files nor terminals: the command
//! line and the app call the same functions.
//!
//! | file | concern |
//! | --- | --- |
//! | `matte` | what an object covers of each pixel, and its colours without those behind it |
//! | `subject` | an object taken apart, relit, and put before another background |
//! | `source`, `lamp`, `surroundings` | new light: a panorama, a lamp, coefficients, what a picture tells of it |
//! | `shot` | pictures of an object in light that stands or turns |
//! | `view` | what a camera sees of a panorama |
//! | `placement` | where an object stands, and how its pixels get there |
//! | `setting` | what a background says of the objects: light, size, tilt of the ground, brightness |
//! | `scene` | objects in a new picture, with their shadows |
//! | `relief`, `shadow` | an object's shape out of its normals, and what it keeps from the ground |
//! | `description` | a scene as a text in TOML |
//! | `matching` | brightness, white balance and grain of a background |
//! | `trust` | how far a decomposition can be trusted, pixel by pixel |
//! | `smooth` | means over squares of pixels |

mod description;
mod error;
mod lamp;
mod matching;
mod matte;
mod placement;
mod relief;
mod scene;
mod setting;
mod shadow;
mod shot;
mod smooth;
mod source;
mod subject;
mod surroundings;
#[cfg(test)]
mod tests;
mod trust;
mod view;

pub use description::{LightDescription, ObjectDescription, SceneDescription, SceneFault};
pub use error::InsertError;
pub use lamp::{DiscLamp, LampFault, colour_of_temperature};
pub use matching::Matching;
pub use matte::Matte;
pub use placement::Placement;
pub use scene::{InsertScene, SceneLayer, SceneObject};
pub use setting::{SceneBackground, SceneSetting};
pub use shot::{Backdrop, Shot, ShotCompanions};
pub use source::{LightSource, exposure_between, likeness};
pub use subject::{EdgeColours, MaterialChange, ObjectGloss, Subject};
pub use trust::{TrustFigures, TrustMap};
pub use view::PanoramaView;
