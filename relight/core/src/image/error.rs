//! What can be wrong with an image or its file.

use std::io;
use std::path::{Path, PathBuf};

use relit_data::still::{ColourError, StillError};

use relit_data::mask::MaskFault;

use super::Extent;

/// What is wrong with an image or its file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// A plane has not one value a pixel.
    #[error("a plane of {found} values was given for {} x {} pixels", extent.width, extent.height)]
    Length {
        /// The size of the image.
        extent: Extent,
        /// The values that the plane has.
        found: usize,
    },
    /// Images that belong together differ in size.
    #[error("the {what} has {} x {} pixels where {} x {} are needed", found.width, found.height, expected.width, expected.height)]
    Extent {
        /// The image that differs.
        what: &'static str,
        /// Its size.
        found: Extent,
        /// The size that it should have.
        expected: Extent,
    },
    /// A file is no mask of an object.
    #[error("the mask {} {fault}", path.display())]
    NotAMask {
        /// The file.
        path: PathBuf,
        /// What it is.
        fault: MaskFault,
    },
    /// A map of normals is empty.
    #[error("{} shows no surface: it has no normals, or none inside the mask", path.display())]
    NoSurface {
        /// The map of normals.
        path: PathBuf,
    },
    /// The file cannot be read.
    #[error("{} cannot be read", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// The file is not an image of a known format.
    #[error("{} is not a readable PNG, JPEG, WebP, TIFF, BMP, GIF, EXR or HDR image", path.display())]
    Decode {
        /// The file.
        path: PathBuf,
        /// What the decoder found.
        source: image::ImageError,
    },
    /// The file ends before the picture does.
    #[error("{} is cut off: a part of the picture is missing; copy the file again", path.display())]
    CutOff {
        /// The file.
        path: PathBuf,
    },
    /// The image is in a format or form that is known and not read.
    #[error("{} {fault}", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// What it is, and what to do.
        fault: StillError,
    },
    /// The image's colours cannot be converted.
    #[error("{} {fault}: convert it to sRGB", path.display())]
    Colour {
        /// The file.
        path: PathBuf,
        /// What it says of its colours.
        fault: ColourError,
    },
    /// The image has more pixels than are read.
    #[error("{} is too large: its pixels would take more than 512 MiB of memory", path.display())]
    TooLarge {
        /// The file.
        path: PathBuf,
    },
    /// A map has a value that it cannot have.
    #[error("{} is no map of {what}: it has a value that is negative, infinite or not a number", path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// What it should be a map of.
        what: &'static str,
    },
    /// The image cannot be encoded.
    #[error("{} cannot be encoded", path.display())]
    Encode {
        /// The file.
        path: PathBuf,
        /// What the encoder answers.
        source: image::ImageError,
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
    /// Puts the path to what is wrong with its content.
    pub(super) fn still(path: &Path) -> impl FnOnce(StillError) -> Self {
        let path = path.to_owned();
        |fault| match fault {
            StillError::Decode(source) => Self::Decode { path, source },
            StillError::CutOff => Self::CutOff { path },
            StillError::TooLarge => Self::TooLarge { path },
            fault => Self::Form { path, fault },
        }
    }
}
