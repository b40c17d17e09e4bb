//! Single-view relighting of the objects that a turntable rig records: light, render layers,
//! data and measures. It reads what `relit-extract` writes and knows nothing else of the toolkit.
//!
//! One frame holds for directions, light and normals everywhere: x to the right, y **up**, z out of
//! the image to the viewer (right-handed). Rows of images count downwards all the same.
//!
//! | module | concern |
//! | --- | --- |
//! | [`image`] | planes of `f32`, colours that know their space, files |
//! | [`light`] | directions, rotations, spherical harmonics, panoramas, normal maps |
//! | [`nets`] | the networks as data, their weights in files, inference |
pub mod image;
pub mod light;
pub mod nets;
#[cfg(feature = "train")]
pub mod train;
