//! Objects out of photographs in another light, and in other pictures. Knows neither files nor terminals: the command
//! line and the app call the same functions.
//!
//! | file | concern |
//! | --- | --- |
//! | `matte` | what an object covers of each pixel, and its colours without those behind it |
//! | `cut` | the part of a photograph around an object |
//! | `subject` | an object decomposed and relit |
//! | `shading`, `material` | what of its shading stays in another light; what its material becomes |
//! | `blend` | an object back in its photograph, or before another background |
//! | `source`, `lamp`, `surroundings` | new light: a panorama, a lamp, coefficients, what a picture shows of it |
//! | `sun` | the sun that is seen in a picture |
//! | `shot` | pictures of an object in light that stands or turns |
//! | `view` | what a camera sees of a panorama |
//! | `placement` | where an object stands, and how its pixels get there |
//! | `setting` | what a background says of the objects: light, size, tilt of the ground, brightness |
//! | `scene`, `scene_object`, `layer` | objects in a new picture, with their shadows |
//! | `relief`, `shadow` | an object's shape out of its normals, and what it keeps from the ground |
//! | `description` | a scene as a text in TOML |
//! | `exposure`, `white_balance` | how bright a panorama is shown, and in which colours its light |
//! | `matching` | brightness, white balance and grain of a background |
//! | `smooth` | means over squares of pixels |

mod blend;
mod cut;
mod description;
mod error;
mod exposure;
mod lamp;
mod layer;
mod matching;
mod material;
mod matte;
mod placement;
mod relief;
mod scene;
mod scene_object;
mod setting;
mod shading;
mod shadow;
mod shot;
mod smooth;
mod source;
mod standing;
mod subject;
mod sun;
mod surroundings;
#[cfg(test)]
mod tests;
mod view;
mod white_balance;

pub use description::{LightDescription, ObjectDescription, SceneDescription};
pub use error::InsertError;
pub use exposure::PanoramaExposure;
pub use lamp::{DiscLamp, colour_of_temperature};
pub use layer::SceneLayer;
pub use matching::Matching;
pub use material::{MaterialChange, ObjectGloss};
pub use placement::Placement;
#[cfg(feature = "files")]
pub(crate) use relief::HeightSolver;
pub use scene::InsertScene;
pub use scene_object::SceneObject;
pub use setting::{SceneBackground, SceneSetting};
pub use shot::{Backdrop, Shot};
pub use source::{LightSource, exposure_between, likeness};
pub use subject::Subject;
pub use sun::SeenSun;
pub use view::PanoramaView;
pub use white_balance::WhiteBalance;
