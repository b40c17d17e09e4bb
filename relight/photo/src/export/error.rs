//! Errors of an export.

use std::path::PathBuf;

use relight_core::captured_object::CapturedObjectError;
use relight_core::image::ImageError;

/// Why something is not exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// There is nothing at the path.
    #[error("{} does not exist: give object.relit, or a folder that relight turn or relight decompose has written", .0.display())]
    Missing(PathBuf),
    /// The input holds no object, or its figures cannot be read.
    #[error("{} {fault}", path.display())]
    Source {
        /// The file or folder.
        path: PathBuf,
        /// The fault.
        fault: String,
    },
    /// The object covers no pixel.
    #[error("the object covers no pixel by half or more: there is nothing to export")]
    Empty,
    /// A map cannot be encoded, or the file would be too large.
    #[error("the object cannot be encoded: {0}")]
    Encode(String),
    /// A picture.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A captured object.
    #[error(transparent)]
    Object(#[from] CapturedObjectError),
}
