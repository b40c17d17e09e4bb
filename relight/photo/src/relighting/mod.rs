//! Objects out of photographs, in another light. Knows neither files nor terminals: the command line and the app call the
//! same functions.
//!
//! | file | concern |
//! | --- | --- |
//! | `matte` | what an object covers of each pixel, and its colours without those behind it |
//! | `fringe` | what stands out beyond its soft edge, as fur does |
//! | `cut` | the part of a photograph around an object |
//! | `relightable_object` | an object decomposed and relit |
//! | `shading`, `material` | what of its shading stays in another light; what its material becomes |
//! | `blend` | an object back in its photograph, or before another background |
//! | `source`, `lamp`, `surroundings` | new light: a panorama, a lamp, coefficients, what a picture shows of it |
//! | `sun` | the sun that is seen in a picture |
//! | `sequence` | pictures of an object in light that stands or turns |
//! | `view` | what a camera sees of a panorama |
//! | `placement`, `placed_object` | where an object stands, and how its pixels get there |
//! | `height_field` | an object's shape out of its normals |
//! | `exposure`, `white_balance` | how bright a panorama is shown, and in which colours its light |
//! | `smooth` | means over squares of pixels |

mod blend;
mod cut;
mod error;
mod exposure;
mod fringe;
mod height_field;
mod lamp;
mod material;
mod matte;
mod placed_object;
mod placement;
mod relightable_object;
mod sequence;
mod shading;
mod smooth;
mod source;
mod sun;
mod surroundings;
#[cfg(test)]
mod tests;
mod view;
mod white_balance;

pub use error::InsertError;
pub(crate) use exposure::WHITE;
pub use exposure::{PanoramaExposure, exposure_for_object};
#[cfg(feature = "files")]
pub(crate) use height_field::HeightSolver;
pub(crate) use height_field::{BLOCK, HeightField};
pub use lamp::{DiscLamp, colour_of_temperature};
pub use material::{MaterialChange, ObjectGloss};
pub(crate) use placed_object::PlacedObject;
pub use placement::Placement;
pub(crate) use placement::{Fit, rows};
pub use relightable_object::RelightableObject;
pub use sequence::{Backdrop, RelightingSequence};
pub use source::{LightSource, exposure_between};
pub use sun::SeenSun;
pub use view::PanoramaView;
pub use white_balance::WhiteBalance;
