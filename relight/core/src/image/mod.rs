//! Images as plain planes of `f32`, and the files that hold them. Knows nothing of light.

mod codec;
mod colour;
mod colour_image;
mod downscaled;
mod error;
mod extent;
mod foreground;
mod planes;
mod png_rows;
mod resize;

pub use codec::{Depth, Samples, StoredImage, encode_exr, encode_jpeg};
pub use colour::{ColourSpace, Linear, Rgb, Srgb, Transfer};
pub use colour_image::ColourImage;
pub use downscaled::DownscaledFile;
pub use error::{ImageError, check_extent};
pub use extent::Extent;
pub use planes::Planes;
pub use png_rows::{encode_png, encode_png_of};
pub(crate) use resize::area_shares;
pub use resize::{Part, beside, connected_parts, reached};
