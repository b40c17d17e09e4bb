//! What a camera sees of a mesh, and which rays of light reach it. Knows neither colours nor lamps.

mod ambient;
mod buffer;
mod occluder;
mod raster;

pub use buffer::GBuffer;
pub(super) use buffer::turned_to;
pub(super) use occluder::Disc;
pub(super) use occluder::Occluder;
