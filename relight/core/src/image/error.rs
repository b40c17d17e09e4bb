//! Errors of images and their files.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

use relit_data::still::{ColourError, StillError};

use relit_data::causes::with_causes;

use super::Extent;

/// An error of an image or its file.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file cannot be read.
    #[error("{} cannot be read", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// The image's colours cannot be converted.
    #[error("{} {fault}: convert it to sRGB", path.display())]
    Colour {
        /// The file.
        path: PathBuf,
        /// The encoding that it states.
        fault: ColourError,
    },
    /// Any other fault, as a sentence.
    #[error("{0}")]
    Other(String),
}

impl ImageError {
    /// For a closure that knows why a file cannot be read.
    pub fn open(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Open { path, source }
    }

    /// That a file is of no use, with the fault and what to do.
    pub fn file(path: &Path, fault: impl Display) -> Self {
        Self::Other(format!("{} {fault}", path.display()))
    }

    /// For a closure that knows why a file cannot be written.
    pub fn write(path: &Path) -> impl Fn(io::Error) -> Self {
        let path = path.to_owned();
        move |reason| Self::file(&path, format!("cannot be written: {reason}"))
    }

    /// For a closure that knows why an image, called `path`, cannot be encoded.
    pub fn encode<E: Display>(path: &Path) -> impl FnOnce(E) -> Self {
        let path = path.to_owned();
        move |reason| Self::file(&path, format!("cannot be encoded: {reason}"))
    }

    /// For a closure that knows what is wrong with the content of a file.
    pub fn still(path: &Path) -> impl FnOnce(StillError) -> Self {
        let path = path.to_owned();
        move |fault| {
            let fault = match fault {
                StillError::Decode(source) => format!(
                    "is not a readable PNG, JPEG, WebP, TIFF, BMP, GIF, EXR or HDR image: {}",
                    with_causes(&source)
                ),
                StillError::CutOff => {
                    "is cut off: a part of the picture is missing; copy the file again".to_owned()
                }
                StillError::TooLarge => {
                    "is too large: its pixels would take more than 512 MiB of memory".to_owned()
                }
                fault => fault.to_string(),
            };
            Self::file(&path, fault)
        }
    }
}

/// That an image has the size that it needs.
///
/// # Errors
/// If it has another.
pub fn check_extent(what: &str, found: Extent, expected: Extent) -> Result<(), ImageError> {
    if found == expected {
        return Ok(());
    }
    Err(ImageError::Other(format!(
        "the {what} has {} x {} pixels where {} x {} are needed",
        found.width, found.height, expected.width, expected.height
    )))
}
