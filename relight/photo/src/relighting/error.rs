//! Why an object cannot be relit or inserted.

use crate::decompose::DecomposeError;
use relight_core::image::ImageError;
use relight_core::light::LightError;

/// Why an object cannot be relit or inserted.
#[derive(Debug, thiserror::Error)]
pub enum InsertError {
    /// The photograph cannot be decomposed.
    #[error(transparent)]
    Decompose(#[from] DecomposeError),
    /// Images do not fit together.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Light cannot be used.
    #[error(transparent)]
    Light(#[from] LightError),
    /// Any other fault, as a sentence.
    #[error("{0}")]
    Input(String),
    /// A scene has a number of objects that cannot be.
    #[error("there are {count} objects: give [[object]] 1 to {most} times")]
    Objects {
        /// How many there are.
        count: usize,
        /// How many there can be.
        most: usize,
    },
}
