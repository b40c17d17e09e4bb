//! Everything that knows paths: pictures and light in files, folders of results.

mod pictures;
mod result_folder;

pub use pictures::{read_planes, write_exr, write_jpeg, write_png, write_png_of};
pub use result_folder::{FolderFault, ResultFolder};
