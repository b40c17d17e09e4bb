//! Photographs, decompositions and scenes in files: inputs from files, folders and shards, networks, light, folders of
//! results, and objects put into pictures and videos.

mod background;
mod input;
mod insertion;
mod insertion_error;
mod light;
mod mask_record;
mod networks;
mod results;

pub use background::BackgroundFile;
pub use input::{FoundPhotos, PhotoInput, PhotoReading, UnusedFile};
pub use insertion::{InsertSource, Insertion, InsertionOutput};
pub use insertion_error::InsertionError;
pub use results::{DecompositionFigures, DecompositionFiles, bright, write_light};
