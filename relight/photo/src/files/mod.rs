//! Photographs and decompositions in files: inputs from files, folders and shards,
//! networks, and folders of results.

mod input;
mod networks;
mod results;

pub use input::{PhotoInput, PhotoReading};
pub use results::{DecompositionFigures, DecompositionFiles, bright, write_light};
