//! What a whole turn says about each pixel: the object stands still, the room passes by, the table lies below.

pub(crate) mod edge;
pub(crate) mod frame_shift;
pub(crate) mod network;
pub(crate) mod pixel_series;
mod smooth;
pub(crate) mod statistics;
pub(crate) mod thin_parts;
