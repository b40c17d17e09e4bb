//! From one photograph to normals, albedo, shading, highlight and light.
//!
//! [`Decomposer`] does it for a picture in memory; [`Photo`] is a picture with its mask as files hold
//! it, and [`DecompositionFiles`] what is written of the result.

mod answer;
mod compose;
mod decomposer;
mod encoding;
mod error;
mod files;
mod gloss;
mod mask;
mod other;
mod photo;
mod region;
mod shipped;
#[cfg(test)]
mod tests;

pub use decomposer::{
    DecomposeOptions, Decomposer, Decomposition, MOST_PIXELS, SpecularGate, WORKING_SIDE,
    WorkingSize,
};
pub use encoding::{AnsweredMaps, EncodedPicture};
#[cfg(feature = "train")]
pub(crate) use encoding::{HIGHLIGHT_OFFSET, LEAST_FACING, LOG_LUMINANCE, LOG_SHADING, MASK};
pub use error::DecomposeError;
pub use files::{DecompositionFigures, DecompositionFiles};
pub(crate) use files::{bright, write_light};
pub use gloss::FittedGloss;
pub(crate) use gloss::fit_gloss;
pub use mask::{MaskSource, Rectangle};
pub use photo::{Photo, PhotoInput, PhotoReading};
pub use region::Region;
