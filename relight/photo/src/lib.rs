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
//!
//! ```
//! use relight_core::image::{Extent, Planes, Rgb};
//! use relight_photo::decompose::{DecomposeOptions, Decomposer};
//! use relight_photo::relighting::{DiscLamp, LightSource, MaterialChange, RelightableObject};
//! use relight_photo::nets::{Weights, decomposer};
//!
//! let weights = Weights::initial(&decomposer(), 1); // not trained
//! let decomposer = Decomposer::with_side(&weights, 32)?;
//! let extent = Extent::new(60, 40);
//! let photo = Rgb::new(Planes::filled(extent, [0.5, 0.4, 0.3]));
//! let mask = Planes::from_fn(extent, |x, _| [f32::from(u8::from((10..50).contains(&x)))]);
//! let subject = RelightableObject::new(&photo, &mask, None, &decomposer, &DecomposeOptions::default())?;
//! let lamp = LightSource::Lamp(DiscLamp { azimuth: 60.0, ..DiscLamp::default() });
//! let relit = subject.relit(&lamp.light()?, &MaterialChange::default())?;
//! let picture = subject.in_place(&photo, &relit);
//! assert_eq!(picture.planes().extent(), extent);
//! # Ok::<(), relight_photo::relighting::InsertError>(())
//! ```

pub mod compositing;
pub mod decompose;
#[cfg(feature = "files")]
pub mod export;
#[cfg(feature = "files")]
pub mod files;
pub mod nets;
pub mod relighting;
