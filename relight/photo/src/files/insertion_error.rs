//! Why objects cannot be put into a picture of a file.

use relight_core::captured_object::CapturedObjectError;
use relight_core::image::ImageError;

use super::MovieError;
use crate::decompose::DecomposeError;
use crate::insert::{InsertError, SceneFault};

/// Why objects cannot be put into a picture of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InsertionError {
    /// An object cannot be relit or inserted.
    #[error(transparent)]
    Insert(#[from] InsertError),
    /// A photograph cannot be read or decomposed.
    #[error(transparent)]
    Decompose(#[from] DecomposeError),
    /// A scene cannot be what it says.
    #[error(transparent)]
    Scene(#[from] SceneFault),
    /// An image cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A captured object cannot be read.
    #[error(transparent)]
    Captured(#[from] CapturedObjectError),
    /// A video cannot be read or written.
    #[error(transparent)]
    Movie(#[from] MovieError),
    /// What is given cannot be used together.
    #[error("{0}")]
    Input(String),
}
