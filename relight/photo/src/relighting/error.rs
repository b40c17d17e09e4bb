//! Why an object cannot be relit or inserted.

use crate::decompose::DecomposeError;
use relight_core::captured_object::CapturedObjectError;
use relight_core::image::ImageError;
use relight_core::light::LightError;

/// Why an object cannot be relit or inserted.
#[derive(Debug, thiserror::Error)]
pub enum InsertError {
    /// A photograph has a value that is negative or not finite.
    #[error(
        "the photograph has a value that is negative, infinite or not a number at column {x}, row {y}"
    )]
    NotLight {
        /// Column of the first.
        x: usize,
        /// Row of the first.
        y: usize,
    },
    /// The photograph cannot be decomposed.
    #[error(transparent)]
    Decompose(#[from] DecomposeError),
    /// Images do not fit together.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Light cannot be used.
    #[error(transparent)]
    Light(#[from] LightError),
    /// The light is dark.
    #[error("the light is completely dark: give another light")]
    Dark,
    /// A text describes no scene, the parts of one cannot be used together, or a video of it cannot be read or written.
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
    /// A captured object cannot be read.
    #[error(transparent)]
    Captured(#[from] CapturedObjectError),
    /// An object cannot stand so.
    #[error("object {number} {fault}")]
    Object {
        /// Which, from 1.
        number: usize,
        /// The fault.
        fault: String,
    },
}
