//! Why a photograph cannot be decomposed.

use std::io;
#[cfg(feature = "files")]
use std::path::Path;
use std::path::PathBuf;

#[cfg(feature = "files")]
use relight_core::files::FolderFault;
use relight_core::image::{Extent, ImageError};
use relight_core::light::{LightError, LightFileError};
use relight_nets::NetError;
#[cfg(feature = "files")]
use relight_reader::{DamagedSample, OpenError};
use relit_data::mask::size_hint;
use relit_data::still::ColourError;

/// Why a photograph cannot be decomposed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DecomposeError {
    /// The network cannot be used.
    #[error(transparent)]
    Net(#[from] NetError),
    /// An image cannot be read or written.
    #[error(transparent)]
    Image(ImageError),
    /// A mask belongs to another picture.
    #[error(
        "the mask has {} x {} pixels, and the photograph {} x {}{}",
        found.width, found.height, expected.width, expected.height, hint(*found, *expected)
    )]
    MaskSize {
        /// The mask's size.
        found: Extent,
        /// The photograph's.
        expected: Extent,
    },
    /// A mask has the sides of the photograph as it is stored.
    #[error(
        "the mask has {} x {} pixels as the photograph is stored, which is displayed turned to {} x {}: make the mask again \
         with this version's relit-mask, or turn it",
        found.width, found.height, expected.width, expected.height
    )]
    MaskStored {
        /// The mask's size.
        found: Extent,
        /// The photograph's.
        expected: Extent,
    },
    /// A mask was made of the photograph as it is stored, or of another form of it.
    #[error(
        "{} was made of {} before it was turned as its Exif orientation says: make it again with this version's relit-mask",
        mask.display(), photo.display()
    )]
    MaskNotTurned {
        /// The mask.
        mask: PathBuf,
        /// The photograph.
        photo: PathBuf,
    },
    /// There is nothing under the mask.
    #[error("the mask is empty: it is nowhere at least one half")]
    EmptyMask,
    /// There are more pixels than are decomposed.
    #[error(
        "the {what} has {} x {} pixels, and at most {most} are decomposed: make the photograph smaller",
        extent.width, extent.height
    )]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// Its size.
        extent: Extent,
        /// The most pixels that are decomposed.
        most: usize,
    },
    /// There is no light on the object.
    #[error("the picture is black all over the object: nothing is lit")]
    Unlit,
    /// A rectangle has nothing of the object.
    #[error(
        "in the rectangle {x},{y},{width},{height} there is nothing of the object: by the photograph's alpha or black \
         background it lies elsewhere"
    )]
    EmptyRectangle {
        /// Column of its left edge.
        x: u32,
        /// Row of its upper edge.
        y: u32,
        /// Its width.
        width: u32,
        /// Its height.
        height: u32,
    },
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
    /// A photograph without light.
    #[error("{} is black all over: there is no object to be seen", path.display())]
    Black {
        /// The photograph.
        path: PathBuf,
    },
    /// Nothing says where the object is.
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
    /// A file says of its colours what is not converted.
    #[error("{} {fault}: convert it to sRGB or EXR, or say by --transfer how to read it", path.display())]
    Colour {
        /// The photograph.
        path: PathBuf,
        /// What it says.
        fault: ColourError,
    },
    /// There are no photographs.
    #[error(
        "{} holds no photographs (PNG, JPEG, WebP, TIFF, BMP, GIF, EXR, HDR) and no shards (.tar){}",
        path.display(), other.as_ref().map(|other| format!("; {other}")).unwrap_or_default()
    )]
    NoPhotos {
        /// The folder.
        path: PathBuf,
        /// What another file of it is.
        other: Option<String>,
    },
    /// Two photographs, or two turns, would be written into one folder.
    #[error(
        "{} and {} would both be written to {name}, at least where a file system ignores case: rename one, or give them \
         different folders by --output, one after the other",
        first.display(), second.display()
    )]
    SameName {
        /// One photograph or data set.
        first: PathBuf,
        /// Another.
        second: PathBuf,
        /// The folder of both.
        name: String,
    },
    /// A result would have the place of another photograph's where a file system ignores case.
    #[error(
        "{} would replace {} where a file system ignores case: rename the photograph, or give another folder by --output",
        path.display(), other.display()
    )]
    NameAlike {
        /// The result.
        path: PathBuf,
        /// What is there.
        other: PathBuf,
    },
    /// A data set cannot be opened.
    #[cfg(feature = "files")]
    #[error(transparent)]
    Open(#[from] OpenError),
    /// A sample of a shard is damaged.
    #[cfg(feature = "files")]
    #[error("a sample is damaged")]
    Damage(#[from] DamagedSample),
    /// No light can be fitted.
    #[error("no light can be fitted")]
    Light(#[from] LightError),
    /// The light cannot be written.
    #[error(transparent)]
    LightFile(#[from] LightFileError),
    /// A folder for results holds something that is no file of a decomposition.
    #[error(
        "{} holds {name}, which is no file of a decomposition: give a folder that is new, empty, or holds an earlier \
         decomposition and nothing else",
        path.display()
    )]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// What it holds.
        name: String,
    },
    /// A path for results cannot be a folder.
    #[error("{} cannot be the folder for the results: give the name of a folder, not of a file", path.display())]
    NoFolder {
        /// The path.
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

/// What a mask of another size may be.
fn hint(found: Extent, expected: Extent) -> String {
    let side = |pixels: usize| u32::try_from(pixels).unwrap_or(u32::MAX);
    let [found, expected] =
        [found, expected].map(|extent| (side(extent.width), side(extent.height)));
    size_hint(found, expected).map_or_else(String::new, |hint| format!(": {hint}"))
}

#[cfg(feature = "files")]
impl DecomposeError {
    /// Puts the path to an operating system's reason.
    pub(crate) fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Read { path, source }
    }

    /// Puts the path to an operating system's reason.
    pub(crate) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write { path, source }
    }
}

#[cfg(feature = "files")]
impl From<FolderFault> for DecomposeError {
    fn from(fault: FolderFault) -> Self {
        match fault {
            FolderFault::Foreign(path, name) => Self::Foreign { path, name },
            FolderFault::NoFolder(path) => Self::NoFolder { path },
            FolderFault::Read(path, source) => Self::Read { path, source },
            FolderFault::Write(path, source) => Self::Write { path, source },
        }
    }
}

impl From<ImageError> for DecomposeError {
    fn from(fault: ImageError) -> Self {
        match fault {
            ImageError::Colour { path, fault } => Self::Colour { path, fault },
            fault => Self::Image(fault),
        }
    }
}
