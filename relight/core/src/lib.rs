//! The basis of relight: light, render layers, measures, and the captured object's file. It knows nothing of
//! networks and terminals, and builds for a browser (`wasm32-unknown-unknown`).
//!
//! One frame holds for directions, light and normals everywhere: x to the right, y **up**, z out of
//! the image to the viewer (right-handed). Rows of images count downwards all the same.
//!
//! | module | concern |
//! | --- | --- |
//! | [`image`] | planes of `f32`, colours that know their space, encoded pictures |
//! | [`light`] | directions, rotations, spherical harmonics, panoramas, normal maps |
//! | [`render`] | diffuse and specular layers on normals |
//! | [`metrics`] | how far an estimate is from the ground truth |
//! | [`captured_object`] | a captured object in one file, ready to be lit |
//! | [`parallel`] | parallel work on rows and parts, if there are threads |
#![cfg_attr(
    feature = "files",
    doc = "| [`files`] | pictures, light, maps and results in files |\n| [`reader`] | shards and the folders of other data sets as streams of arrays |"
)]
//!
//! Without features it takes bytes and gives bytes, on one thread. The feature `files` reads and writes files, and
//! `threads` works on rayon's threads; results are the same bits with and without.
//!
//! ```
//! use relight_core::light::{Normals, Order, ShLight};
//! use relight_core::render::{DiffuseForm, DiffuseLayer};
//!
//! // A white ball in even light of radiance 1: its irradiance is π everywhere.
//! let ball = Normals::sphere(65);
//! let light = ShLight::even(Order::TWO, [1.0; 3]);
//! let shading = DiffuseLayer::new(&light, DiffuseForm::Irradiance).shading(&ball);
//! let middle = shading.planes().pixel(32, 32)[0];
//! assert!((middle - std::f32::consts::PI).abs() < 1e-4);
//! ```

pub mod captured_object;
#[cfg(feature = "files")]
pub mod files;
pub mod image;
pub mod light;
pub mod metrics;
pub mod parallel;
#[cfg(feature = "files")]
pub mod reader;
pub mod render;
