//! Errors of making data.

use std::io;
use std::path::{Path, PathBuf};

use relit_data::shard;

use relight_core::image::ImageError;
use relight_core::light::LightError;

/// Why data could not be made.
#[derive(Debug, thiserror::Error)]
pub enum SynthError {
    /// A file or folder could not be read or written.
    #[error("{path} could not be {doing}")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// `read` or `written`.
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
    /// A file or folder is not as required.
    #[error("{path} {fault}")]
    Unusable {
        /// The file or folder.
        path: PathBuf,
        /// The fault, and what to do.
        fault: String,
    },
    /// What was given cannot be used.
    #[error("{0}")]
    Refused(String),
    /// A texture or an image cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The numbers are not a light.
    #[error(transparent)]
    Light(#[from] LightError),
    /// A picture could not be encoded.
    #[error("a picture could not be encoded as PNG")]
    Png(#[from] png::EncodingError),
    /// A shard could not be written.
    #[error(transparent)]
    Shard(#[from] shard::ShardError),
    /// An image and its mask differ in size.
    #[error(transparent)]
    Size(#[from] relit_data::image_stats::SizeMismatch),
}

impl SynthError {
    /// For `map_err` on what reads `path`.
    pub(super) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        Self::io(path, "read")
    }

    /// For `map_err` on what writes `path`.
    pub(super) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        Self::io(path, "written")
    }

    fn io(path: &Path, doing: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io {
            path,
            doing,
            source,
        }
    }

    /// A file or folder is not as required.
    pub(super) fn unusable(path: &Path, fault: impl Into<String>) -> Self {
        Self::Unusable {
            path: path.to_owned(),
            fault: fault.into(),
        }
    }

    /// For `map_err` on what reads a mesh.
    pub(super) fn mesh(path: &Path) -> impl FnOnce(String) -> Self {
        move |reason| {
            let fault = format!(
                "is a mesh that cannot be used: {reason}; repair it, or remove it from the folder"
            );
            Self::unusable(path, fault)
        }
    }

    /// A folder was made with other settings.
    pub(super) fn other_settings(path: &Path) -> Self {
        let fault = "holds samples that were made with other settings: give the same ones, or another folder";
        Self::unusable(path, fault)
    }
}
