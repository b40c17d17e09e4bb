//! What a whole turn says about each pixel: the object stands still, the room passes by, the table lies below.

pub(crate) mod backdrop;
pub(crate) mod disc;
pub(crate) mod edge;
pub(crate) mod enclosed_regions;
pub(crate) mod frame_shift;
pub(crate) mod pixel_series;
pub(crate) mod statistics;
pub(crate) mod subspace;
pub(crate) mod table;
pub(crate) mod table_model;
pub(crate) mod temporal_evidence;
pub(crate) mod thin_parts;
