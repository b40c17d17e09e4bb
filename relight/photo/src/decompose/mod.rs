//! From one photograph to normals, albedo, shading, highlight and light.
//!
//! [`Decomposer`] does it for a picture in memory; [`Photo`] is a picture with its mask out of the
//! content of a file.

mod compose;
mod crop;
mod decomposer;
mod encoding;
mod error;
mod gloss;
mod light;
mod mask;
mod network_output;
mod paint;
mod photo;
#[cfg(test)]
mod tests;
mod tiled_compose;
mod usable_image;

pub use crop::CropSquare;
pub use decomposer::{
    DecomposeOptions, Decomposer, Decomposition, MAX_PIXELS, SpecularGate, WORKING_SIDE,
};
pub use encoding::{
    HIGHLIGHT_OFFSET, LOG_FLOOR, LOG_LUMINANCE, LOG_SHADING, MASK, MAX_LIGHT, MIN_FACING,
    NetworkInput, PredictedMaps,
};
pub use error::DecomposeError;
pub use gloss::{FittedGloss, fit_gloss};
pub use light::PredictedLight;
pub use mask::MaskSource;
#[cfg(feature = "files")]
pub(crate) use photo::stem;
pub use photo::{Photo, PhotoHints, stated_extent};
pub use usable_image::UsableImage;
