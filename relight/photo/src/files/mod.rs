//! Photographs, decompositions and scenes in files: inputs from files, folders and shards, light, folders of
//! results, objects put into pictures and videos, and videos by the program `ffmpeg`.

mod background;
mod input;
mod insertion;
mod light;
mod movie;
mod movie_reader;
mod output;
mod results;

pub use background::BackgroundFile;
pub use input::{PhotoInput, PhotoList, PhotoReading, UnusedFile};
pub use insertion::{InsertSource, Insertion, InsertionOutput};
pub use movie::{FrameRate, MovieFormat, MovieWriter};
pub use movie_reader::{FrameTiming, MovieReader};
pub use output::{OutputKind, write_picture};
pub use results::{DecompositionFigures, DecompositionFiles, bright, write_light};
