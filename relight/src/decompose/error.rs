//! Why a photograph cannot be decomposed.

use std::io;
use std::path::{Path, PathBuf};

use crate::data::{DamagedSample, OpenError};
use crate::image::{Extent, ImageError};
use crate::light::{LightError, LightFileError};
use crate::nets::NetError;
use crate::whole::FolderFault;

/// Why a photograph cannot be decomposed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DecomposeError {
    /// There are no weights.
    #[error("this build holds no weights: give a file of them by --weights")]
    NoWeights,
    /// The network cannot be used.
    #[error(transparent)]
    Net(#[from] NetError),
    /// An image cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A mask belongs to another picture.
    #[error("the mask has {} x {} pixels, and the photograph {} x {}", found.width, found.height, expected.width, expected.height)]
    MaskSize {
        /// The mask's size.
        found: Extent,
        /// The photograph's.
        expected: Extent,
    },
    /// There is nothing under the mask.
    #[error("the mask is empty: it is nowhere at least one half")]
    EmptyMask,
    /// A rectangle lies beside the photograph.
    #[error("the rectangle {x},{y},{width},{height} does not touch the photograph of {} x {} pixels", photo.width, photo.height)]
    Rectangle {
        /// Column of its left edge.
        x: u32,
        /// Row of its upper edge.
        y: u32,
        /// Its width.
        width: u32,
        /// Its height.
        height: u32,
        /// The photograph's size.
        photo: Extent,
    },
    /// Nobody says where the object is.
    #[error(
        "{} does not say where the object is: it has no alpha, and its background is not black. \
         Make a mask with `relit-mask` and give it by --mask, or the rectangle around the object by --rect",
        path.display()
    )]
    NoMask {
        /// The photograph.
        path: PathBuf,
    },
    /// No mask in the folder of masks belongs to a photograph.
    #[error("there is no mask {}", path.display())]
    MaskMissing {
        /// Where it should be.
        path: PathBuf,
    },
    /// A file says that its values are encoded in a way that is not known here.
    #[error(
        "{} says that its values are encoded by the power 1 / {gamma}: say by --transfer how to read them",
        path.display()
    )]
    UnknownGamma {
        /// The photograph.
        path: PathBuf,
        /// The gamma of its file.
        gamma: f32,
    },
    /// There are no photographs.
    #[error("{} holds no photographs (.png, .jpg, .exr, .hdr) and no shards (.tar)", path.display())]
    NoPhotos {
        /// The folder.
        path: PathBuf,
    },
    /// Two photographs would be written into one folder.
    #[error("{} and {} would both be written to {}: decompose them one by one", first.display(), second.display(), name)]
    SameName {
        /// One photograph.
        first: PathBuf,
        /// Another.
        second: PathBuf,
        /// The folder of both.
        name: String,
    },
    /// A data set cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A sample of a shard is damaged.
    #[error("a sample is damaged")]
    Damage(#[from] DamagedSample),
    /// No light can be fitted.
    #[error("no light can be fitted")]
    Light(#[from] LightError),
    /// The light cannot be written.
    #[error(transparent)]
    LightFile(#[from] LightFileError),
    /// A folder for results holds something else.
    #[error("{} holds other files: give a folder that is new, empty, or holds an earlier decomposition", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
    },
    /// A file or folder cannot be read.
    #[error("{} could not be read", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
    /// A file or folder cannot be written.
    #[error("{} could not be written", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's answer.
        source: io::Error,
    },
}

impl DecomposeError {
    /// Puts the path to an operating system's reason.
    pub(super) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Read { path, source }
    }

    /// Puts the path to an operating system's reason.
    pub(super) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write { path, source }
    }
}

impl From<FolderFault> for DecomposeError {
    fn from(fault: FolderFault) -> Self {
        match fault {
            FolderFault::Foreign(path) => Self::Foreign { path },
            FolderFault::Read(path, source) => Self::Read { path, source },
            FolderFault::Write(path, source) => Self::Write { path, source },
        }
    }
}
