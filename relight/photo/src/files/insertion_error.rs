//! Why objects cannot be put into a picture of a file.

use std::path::PathBuf;

use relight_core::captured_object::CapturedObjectError;
use relight_core::files::MovieError;
use relight_core::image::ImageError;
use relight_core::light::{LightFileError, PanoramaError};

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
    /// A panorama cannot be read.
    #[error(transparent)]
    Panorama(#[from] PanoramaError),
    /// Coefficients of light cannot be read.
    #[error(transparent)]
    LightFile(#[from] LightFileError),
    /// A video cannot be read or written.
    #[error(transparent)]
    Movie(#[from] MovieError),
    /// A mask is given for a captured object.
    #[error("{}: it has its own mask, give none", path.display())]
    OwnMask {
        /// The captured object.
        path: PathBuf,
    },
    /// A background has values that are no light.
    #[error("{} has a value that is negative, infinite or not a number", path.display())]
    NotLight {
        /// The background.
        path: PathBuf,
    },
    /// A background has no frame.
    #[error("the video has no frame")]
    NoFrame,
    /// Light is to be taken from an object of a panorama.
    #[error("light.object: a panorama shows its light itself; give a photograph or a video")]
    LightInPanorama,
    /// Light cannot be taken from an object of the background.
    #[error("{}", path.display())]
    LightObject {
        /// The object's mask.
        path: PathBuf,
        /// Why.
        source: InsertError,
    },
}
