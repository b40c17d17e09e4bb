//! Photographs: an object's normals, albedo, shading, highlight and light out of one picture, and the object in another
//! light or another picture. It knows no terminal, and builds for a browser
//! (`wasm32-unknown-unknown`).
//!
//! | module | concern |
//! | --- | --- |
//! | [`decompose`] | a photograph into normals, albedo, shading, highlight and light |
//! | [`nets`] | the networks as data, their weights and inference |
//! | [`relighting`] | objects of photographs in another light |
//! | [`compositing`] | objects of photographs in other pictures, with their shadows |
#![cfg_attr(
    feature = "files",
    doc = "| [`files`], [`export`] | photographs and decompositions in files and shards; objects for other programs |"
)]
//!
//! The feature `files` reads photographs from files and shards and writes results, `threads` works on rayon's threads.

pub mod compositing;
pub mod decompose;
#[cfg(feature = "files")]
pub mod export;
#[cfg(feature = "files")]
pub mod files;
pub mod nets;
pub mod relighting;

/// The example of the README compiles.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
