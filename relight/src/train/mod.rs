//! Training, on libtorch (feature `train`). The one module that knows it.
//!
//! [`Model`] computes a [`crate::nets::Graph`] on tensors, so that what is trained is what the ONNX file
//! holds. [`Adam`] keeps its memory where it can be saved.

mod adam;
mod error;
pub mod losses;
pub mod low_rank;
mod model;

pub use adam::{Adam, AdamSettings};
pub use error::TrainError;
pub use model::{ComputePrecision, Model};
