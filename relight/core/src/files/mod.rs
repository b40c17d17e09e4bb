//! Everything that knows paths: pictures and light in files, an object's maps, videos, folders of results.

mod maps;
mod movie;
mod movie_reader;
mod output;
mod parent;
mod pictures;
mod result_folder;

pub use maps::{Map, MapFiles};
pub use movie::{FrameRate, MovieError, MovieFormat, MovieWriter};
pub use movie_reader::{FrameTiming, MovieReader};
pub use output::{OutputKind, write_picture};
pub use pictures::{read_planes, write_exr, write_jpeg, write_png, write_png_of};
pub use result_folder::{FolderFault, ResultFolder};
