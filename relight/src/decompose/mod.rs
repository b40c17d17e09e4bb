//! From one photograph to normals, albedo, shading, highlight and light.

mod encoding;

pub use encoding::{AnsweredMaps, EncodedPicture};
#[cfg(feature = "train")]
pub(crate) use encoding::{HIGHLIGHT_OFFSET, LEAST_FACING, LOG_LUMINANCE, LOG_SHADING, MASK};
