//! Images as plain planes of `f32`, and the files that hold them. Knows nothing of light.

mod codec;
mod colour;
mod error;
mod extent;
mod mask;
mod planes;
mod png_rows;
mod reduced;
mod resize;
mod wholeness;

pub use codec::{Depth, Samples, StoredImage, encode_exr, encode_jpeg, exif_orientation};
pub use colour::{ColourSpace, Gamma22, Linear, Rgb, Srgb, Transfer};
pub use error::ImageError;
pub use extent::Extent;
pub use planes::Planes;
pub use png_rows::{encode_png, encode_png_of};
pub use reduced::ReducedFile;
pub use resize::{Part, area_shares, beside};
