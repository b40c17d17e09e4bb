//! Why a photograph cannot be decomposed.

#[cfg(feature = "files")]
use std::fmt::Display;
#[cfg(feature = "files")]
use std::io;
#[cfg(feature = "files")]
use std::path::Path;
use std::path::PathBuf;

use crate::nets::NetError;
#[cfg(feature = "files")]
use relight_core::files::FolderFault;
use relight_core::image::ImageError;
use relight_core::light::LightError;

/// Why a photograph cannot be decomposed.
#[derive(Debug, thiserror::Error)]
pub enum DecomposeError {
    /// The network cannot be used.
    #[error(transparent)]
    Net(#[from] NetError),
    /// An image cannot be read or written.
    #[error(transparent)]
    Image(ImageError),
    /// The folder of the results cannot be read or written.
    #[cfg(feature = "files")]
    #[error(transparent)]
    Folder(#[from] FolderFault),
    /// Any other fault, as a sentence.
    #[error("{0}")]
    Photo(String),
    /// There is nothing under the mask.
    #[error("the mask is empty: no pixel is at least one half")]
    EmptyMask,
    /// A photograph without light.
    #[error("{} is completely black: give a brighter photograph", path.display())]
    Black {
        /// The photograph.
        path: PathBuf,
    },
    /// The object's place is unknown.
    #[error(
        "{} does not say where the object is: give a mask with --mask (`relit-mask` makes one), or a rectangle around the \
         object with --rect",
        path.display()
    )]
    NoMask {
        /// The photograph.
        path: PathBuf,
    },
    /// No light can be fitted.
    #[error("no light can be fitted")]
    Light(#[from] LightError),
}

#[cfg(feature = "files")]
impl DecomposeError {
    pub(crate) fn file(path: &Path, fault: impl Display) -> Self {
        Self::Photo(format!("{} {fault}", path.display()))
    }

    /// Puts the path to an operating system's reason.
    pub(crate) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |reason| Self::file(&path, format!("cannot be read: {reason}"))
    }

    /// Puts the path to an operating system's reason.
    pub(crate) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |reason| Self::file(&path, format!("cannot be written: {reason}"))
    }
}

impl From<ImageError> for DecomposeError {
    fn from(fault: ImageError) -> Self {
        match fault {
            ImageError::Colour { path, fault } => Self::Photo(format!(
                "{} {fault}: convert it to sRGB or EXR, or give its encoding with --transfer",
                path.display()
            )),
            fault => Self::Image(fault),
        }
    }
}
