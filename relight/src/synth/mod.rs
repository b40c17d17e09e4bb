//! Pictures of objects together with the truth that they were made of.

mod error;
mod geometry;
mod mesh;
mod noise;
mod paint;
mod random;
mod shape;
mod view;

pub use error::Error;
pub use geometry::{GBuffer, Occluder};
pub use mesh::{Mesh, MeshFault};
pub use paint::{AlbedoKind, Paint, Picture, Relief};
pub use random::stream;
pub use shape::ShapeKind;
pub use view::{Pose, Projection};
