//! What the frames show: curves over the table's angle, and a ball that measures the light.

pub(crate) mod conditioning;
pub(crate) mod curves;
pub(crate) mod mirror_panorama;
pub(crate) mod origin;
pub(crate) mod probe;
pub(crate) mod probe_place;
pub(crate) mod reading;
pub(crate) mod verdict;
pub(crate) mod video_probe;
