//! Pictures of objects together with the truth that they were made of.

mod error;
mod mesh;
mod noise;
mod random;

pub use error::Error;
pub use mesh::{Mesh, MeshFault};
pub use random::stream;
