//! What can go wrong while data is made.

use std::io;
use std::path::{Path, PathBuf};

/// Why data could not be made.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A file or folder could not be read.
    #[error("{path} could not be read")]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// A file or folder could not be written.
    #[error("{path} could not be written")]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// A mesh is damaged, or not a surface.
    #[error("the mesh {path} cannot be used: {reason}; mend it, or take it out of the folder")]
    Mesh {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A file is no mesh.
    #[error("{path} is no mesh that can be read: give .obj, .gltf or .glb")]
    MeshKind {
        /// The file.
        path: PathBuf,
    },
    /// A texture cannot be read.
    #[error("{path} cannot be read as a picture: give PNG or JPEG")]
    Picture {
        /// The file.
        path: PathBuf,
        /// The decoder's word.
        source: image::ImageError,
    },
}

impl Error {
    /// For `map_err` on what reads `path`.
    pub(super) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Read { path, source }
    }

    /// For `map_err` on what writes `path`.
    pub(super) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Write { path, source }
    }
}
