//! What can be wrong with light or its file.

use std::io;
use std::path::PathBuf;

/// What is wrong with light.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LightError {
    /// The order is too high.
    #[error("spherical harmonics of order {asked} were asked for, and {highest} is the highest")]
    Order {
        /// What was asked for.
        asked: usize,
        /// The highest that there is.
        highest: usize,
    },
    /// There are not as many coefficients as an order has.
    #[error("{0} coefficients were given where 1, 4, 9, 16, ... make an order")]
    Count(usize),
    /// A line of coefficients does not have three numbers.
    #[error("line {line} of the coefficients has not three finite numbers (red, green, blue)")]
    Line {
        /// The line, from 1.
        line: usize,
    },
    /// A value is infinite or not a number.
    #[error("the light has a value that is infinite or not a number")]
    NotFinite,
    /// There are too few pixels for a fit.
    #[error("there are too few pixels for a fit of so many coefficients")]
    TooFewPixels,
    /// The panorama has no pixels.
    #[error("the panorama has no pixels")]
    Empty,
}

/// Why a file of coefficients is not read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LightFileError {
    /// It cannot be read.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// It does not hold coefficients.
    #[error("{} holds no light", path.display())]
    Light {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: LightError,
    },
    /// It cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
}
