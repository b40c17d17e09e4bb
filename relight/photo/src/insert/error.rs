//! Why an object cannot be relit or inserted.

use crate::decompose::DecomposeError;
use relight_core::image::{Extent, ImageError};
use relight_core::light::LightError;

/// Why an object cannot be relit or inserted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InsertError {
    /// A photograph has values that are no light.
    #[error(
        "the photograph has a value that is negative, infinite or not a number at column {x}, row {y}"
    )]
    NotLight {
        /// Column of the first.
        x: usize,
        /// Row of the first.
        y: usize,
    },
    /// An image belongs to another picture.
    #[error("the {what} has {} x {} pixels, and the photograph {} x {}", found.width, found.height, expected.width, expected.height)]
    Size {
        /// Which image.
        what: &'static str,
        /// Its size.
        found: Extent,
        /// The photograph's.
        expected: Extent,
    },
    /// The photograph cannot be decomposed.
    #[error(transparent)]
    Decompose(#[from] DecomposeError),
    /// Maps do not fit together.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// Light cannot be used.
    #[error(transparent)]
    Light(#[from] LightError),
    /// There is no light at all.
    #[error("the light is dark: it has no radiance from anywhere")]
    Dark,
    /// An object cannot stand so.
    #[error("object {object}: its {what} is {value}, it has to be from {least} to {most}")]
    Placement {
        /// Which, from 1.
        object: usize,
        /// What is wrong.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The least that it may be.
        least: f64,
        /// The most.
        most: f64,
    },
    /// An object would not be seen.
    #[error("object {object} would lie wholly outside the picture: its place is {},{}, in parts of the picture's sides", at[0], at[1])]
    Outside {
        /// Which, from 1.
        object: usize,
        /// Its place.
        at: [f64; 2],
    },
    /// An object would be enlarged too much.
    #[error(
        "object {object} would be enlarged {growth:.0} times: give a larger photograph or a smaller height"
    )]
    Growth {
        /// Which, from 1.
        object: usize,
        /// How many times.
        growth: f64,
    },
}
