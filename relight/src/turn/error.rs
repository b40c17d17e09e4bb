//! Why a turn cannot be solved.

use std::io;
use std::path::{Path, PathBuf};

use relit_data::session::SessionError;

use crate::asset::AssetError;
use crate::data::OpenError;
use crate::decompose::DecomposeError;
use crate::image::{Extent, ImageError};
use crate::light::{LightError, LightFileError};
use crate::movie::MovieError;
use crate::whole::FolderFault;

/// Why a turn cannot be solved, or what was found cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TurnError {
    /// The shard cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// There is more than one turn.
    #[error("{} holds {found} turns: give the shard (.tar) of one", path.display())]
    ManyTurns {
        /// The data set.
        path: PathBuf,
        /// How many it has.
        found: usize,
    },
    /// Frames are missing, and none of them has an angle.
    #[error(
        "the frames have no angles, and only {found} of at least {indices} of the turn are there: without angles, a turn has to be whole"
    )]
    NoAngles {
        /// How many frames there are.
        found: u32,
        /// The last frame's number, from 1.
        indices: u64,
    },
    /// A frame has another size than the first.
    #[error("a frame has {} x {} pixels where {} x {} are needed", found.width, found.height, expected.width, expected.height)]
    FrameSize {
        /// The frame's size.
        found: Extent,
        /// The size of the first.
        expected: Extent,
    },
    /// There is nothing under the mask.
    #[error("no frame has a pixel under the mask")]
    Empty,
    /// There are too few angles.
    #[error(
        "{angles} different angles were found: five terms a pixel need at least {needed}, spread over the turn"
    )]
    TooFewAngles {
        /// How many there are.
        angles: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A setting cannot be.
    #[error("{what} is {value}: it has to be {allowed}")]
    Setting {
        /// Which.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What may be given.
        allowed: &'static str,
    },
    /// No light explains the curves.
    #[error("no light explains the turn: all of it is dark, or all of it is clipped")]
    NoLight,
    /// A map of normals has another size than the frames.
    #[error("the normals have {} x {} pixels, and the frames {} x {}", found.width, found.height, expected.width, expected.height)]
    PriorSize {
        /// The size of the map.
        found: Extent,
        /// The size of the frames.
        expected: Extent,
    },
    /// A network for normals cannot be used.
    #[error("the normals to start from cannot be made")]
    Decompose(#[from] DecomposeError),
    /// An image cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The object cannot be made a file.
    #[error("the object cannot be written as a file that can be lit")]
    Asset(#[source] Box<AssetError>),
    /// Metal has no matt part that a network could learn from.
    #[error(
        "the object is taken for metal, which has no albedo and shading apart: there are no labels of it"
    )]
    NoMattPart,
    /// Light cannot be used.
    #[error(transparent)]
    Light(#[from] LightError),
    /// Light cannot be read or written.
    #[error(transparent)]
    LightFile(#[from] LightFileError),
    /// The folder for results holds something else.
    #[error("{} holds {name}, which is no result of a turn: give a folder that is new, empty, or holds an earlier result", path.display())]
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
    /// The session whose video shows the room cannot be read.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The video is not that of the turn.
    #[error("none of the turn's frames is among the {frames} of {}: give the session from which the shard was made", path.display())]
    OtherVideo {
        /// The video.
        path: PathBuf,
        /// How many frames it has.
        frames: u64,
    },
    /// A video cannot be read or written.
    #[error(transparent)]
    Movie(#[from] MovieError),
    /// A file or folder cannot be read.
    #[error("{} cannot be read", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
    /// A file or folder cannot be written.
    #[error("{} cannot be written", path.display())]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the system answers.
        source: io::Error,
    },
}

impl TurnError {
    /// Puts the path to an operating system's reason.
    pub(super) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write { path, source }
    }
}

impl From<AssetError> for TurnError {
    fn from(error: AssetError) -> Self {
        Self::Asset(Box::new(error))
    }
}

impl From<FolderFault> for TurnError {
    fn from(fault: FolderFault) -> Self {
        match fault {
            FolderFault::Foreign(path, name) => Self::Foreign { path, name },
            FolderFault::NoFolder(path) => Self::NoFolder { path },
            FolderFault::Read(path, source) => Self::Read { path, source },
            FolderFault::Write(path, source) => Self::Write { path, source },
        }
    }
}
