//! Errors of images and their files.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

use relit_data::still::{ColourError, StillError};

use relit_data::causes::with_causes;
use relit_data::mask::MaskFault;

use super::Extent;

/// An error of an image or its file.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// Images that belong together, or the planes of one, differ in size.
    #[error("{0}")]
    Size(String),
    /// A file is not a mask of an object.
    #[error("the mask {} {fault}", path.display())]
    NotAMask {
        /// The file.
        path: PathBuf,
        /// What it is.
        fault: MaskFault,
    },
    /// The file cannot be read.
    #[error("{} cannot be read", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// The file holds no image that can be used, or an image cannot become one.
    #[error("{} {fault}", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// What it is, and what to do.
        fault: String,
    },
    /// The image's colours cannot be converted.
    #[error("{} {fault}: convert it to sRGB", path.display())]
    Colour {
        /// The file.
        path: PathBuf,
        /// The encoding that it states.
        fault: ColourError,
    },
    /// The file cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
}

impl ImageError {
    /// For a closure that knows why a file cannot be read.
    pub fn open(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Open { path, source }
    }

    /// For a closure that knows why an image, called `path`, cannot be encoded.
    pub fn encode<E: Display>(path: &Path) -> impl FnOnce(E) -> Self {
        let path = path.to_owned();
        move |reason| Self::Form {
            path,
            fault: format!("cannot be encoded: {reason}"),
        }
    }

    /// For a closure that knows what is wrong with the content of a file.
    pub fn still(path: &Path) -> impl FnOnce(StillError) -> Self {
        let path = path.to_owned();
        |fault| {
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
            Self::Form { path, fault }
        }
    }
}

/// That an image has the size that it needs.
///
/// # Errors
/// [`ImageError::Size`].
pub fn check_extent(what: &str, found: Extent, expected: Extent) -> Result<(), ImageError> {
    if found == expected {
        return Ok(());
    }
    Err(ImageError::Size(format!(
        "the {what} has {} x {} pixels where {} x {} are needed",
        found.width, found.height, expected.width, expected.height
    )))
}
