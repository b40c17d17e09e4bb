//! Normals, albedo and light that fit the curves.

pub(crate) mod by_network;
pub(crate) mod curve_statistics;
pub(crate) mod environment;
pub(crate) mod given_light;
pub(crate) mod known_light;
pub(crate) mod photo_albedo;
pub(crate) mod probe_check;
pub(crate) mod probe_light;
pub(crate) mod smoothing;
pub(crate) mod solution;
