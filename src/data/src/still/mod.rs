//! Still image files as they are displayed, for all programs: upright, decoded, and with what their numbers stand for.
//!
//! | module | purpose |
//! | --- | --- |
//! | `format` | which format a file has, by its content, and which formats are read |
//! | `decode` | the pixels, upright; what is missing of them |
//! | `colour` | what the pixels' numbers stand for, and their conversion to light in Rec. 709 |
//! | `exr`, `radiance`, `jpeg`, `tiff` | what the decoders do not tell |
//!
//! It knows bytes only, and no files.

mod colour;
mod decode;
mod error;
mod exr;
mod format;
pub mod jpeg;
mod orientation;
mod png_exif;
mod radiance;
mod tiff;

pub use colour::Colour;
pub use decode::{decode, stored_size};
pub use error::{ColourError, StillError};
pub use format::{ENDINGS, Format, is_named};
pub use image::metadata::Orientation;
pub use orientation::orientation;
