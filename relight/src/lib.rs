//! Single-view relighting of the objects that a turntable rig records: light, render layers,
//! data and measures. It reads what `relit-extract` writes and knows nothing else of the toolkit.
//!
//! One frame holds for directions, light and normals everywhere: x to the right, y **up**, z out of
//! the image to the viewer (right-handed). Rows of images count downwards all the same.
//!
//! | module | concern |
//! | --- | --- |
//! | [`asset`] | a captured object in one file, ready to be lit |
//! | [`data`] | shards and folders as streams of arrays |
//! | [`decompose`] | a photograph into normals, albedo, shading, highlight and light |
//! | [`eval`] | the protocols of the paper's tables |
//! | [`image`] | planes of `f32`, colours that know their space, files |
//! | [`insert`] | objects out of photographs in another light and in other pictures |
//! | [`light`] | directions, rotations, spherical harmonics, panoramas, normal maps |
//! | [`metrics`] | how far an estimate is from the truth |
//! | [`movie`] | frames into MP4 and WebM, by the `ffmpeg` program |
//! | [`nets`] | the networks as data, their weights in files, inference |
//! | [`render`] | diffuse and specular layers on normals, their derivatives, the truth by Monte Carlo |
//! | [`synth`] | pictures of objects with the truth that they were made of |
//! | [`turn`] | a whole turn into normals, albedo and light, without training |
pub mod asset;
pub mod data;
pub mod decompose;
pub mod eval;
pub mod image;
pub mod insert;
pub mod light;
pub mod metrics;
pub mod movie;
pub mod nets;
pub mod render;
pub mod synth;
#[cfg(feature = "train")]
pub mod train;
pub mod turn;
mod whole;
