//! Images as plain planes of `f32`, and the files that hold them. Knows nothing of light.

mod colour;
mod error;
mod files;
mod planes;
mod resize;

pub use colour::{ColourSpace, Gamma22, Linear, Rgb, Srgb, Transfer};
pub use error::ImageError;
pub use files::{Depth, Samples, StoredImage, read_planes, write_exr, write_png};
pub use planes::{Extent, Planes};
pub(crate) use resize::{Part, area_shares, beside};
