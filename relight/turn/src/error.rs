//! Why a turn cannot be solved.

use std::io;
use std::path::{Path, PathBuf};

use relight_core::captured_object::CapturedObjectError;
use relight_core::files::FolderFault;
use relight_core::image::{Extent, ImageError};
use relight_core::light::LightError;
use relight_core::reader::OpenError;
use relight_photo::decompose::DecomposeError;
use relight_photo::files::MovieError;
use relit_data::session::SessionError;

use crate::observe::probe_place::ProbePlace;
use crate::observe::verdict::LightVerdict;
use crate::setting_error::SettingError;

/// Why a turn cannot be solved, or what was found cannot be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TurnError {
    /// The shard cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The shard is damaged, and what is left of it does not do.
    #[error("{} is damaged ({damage}), and what is left of it does not do", path.display())]
    Damaged {
        /// The shard.
        path: PathBuf,
        /// The first damage.
        damage: String,
        /// Why the rest does not do.
        source: Box<TurnError>,
    },
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
    #[error(transparent)]
    Setting(#[from] SettingError),
    /// No light fits the curves.
    #[error("no light explains the turn: all of it is dark, or all of it is clipped")]
    NoLight,
    /// The exposure was wrong.
    #[error("no light explains the turn: {}", .0.advice().unwrap_or("it is wrongly exposed"))]
    Unfit(LightVerdict),
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
    Asset(#[source] Box<CapturedObjectError>),
    /// Metal has no diffuse part that a network could learn from.
    #[error(
        "the object is taken for metal, which has no albedo and shading apart: there are no labels of it"
    )]
    NoDiffusePart,
    /// Normals and albedo are not observable.
    #[error("no labels are written: the turn does not determine normals and albedo")]
    NotObservable,
    /// No pixel is confident enough.
    #[error(
        "no labels are written: no pixel's confidence reaches {least}, the highest is {most:.2}"
    )]
    NotConfident {
        /// The least confidence that was asked for.
        least: f32,
        /// The largest there is.
        most: f32,
    },
    /// Light cannot be used.
    #[error(transparent)]
    Light(#[from] LightError),
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
    /// The session whose video shows the surroundings cannot be read.
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
    /// The shard says that it was made from another session.
    #[error("the shard was made from the session {session}, and {} is the session {found}: give the session from which the shard was made", path.display())]
    OtherSession {
        /// The session that was given.
        path: PathBuf,
        /// Its id.
        found: String,
        /// The id in the shard's records.
        session: String,
    },
    /// The video shows something else than the shard.
    #[error("the frames of {} do not show what those of the shard do: give the session from which the shard was made", path.display())]
    OtherPictures {
        /// The video.
        path: PathBuf,
    },
    /// The ball is under the object's mask.
    #[error(
        "the object's mask covers {percent:.0} % of the ball at {given}: measure the ball's place in the video again, or take the ball out of the mask"
    )]
    BallInMask {
        /// Where it is said to be.
        given: ProbePlace,
        /// The part of the ball that is covered.
        percent: f64,
    },
    /// There is no ball.
    #[error(
        "the circle at {given} shows no ball: the light by it explains {explained:.0} % of what varies in it; measure the ball's middle and radius in the video again, \
         see that nothing covers it, and say what the ball is made of"
    )]
    NoBall {
        /// Where it is said to be.
        given: ProbePlace,
        /// The part that is explained, percent.
        explained: f64,
    },
    /// The ball is elsewhere.
    #[error("the ball is not at {given}, where the light by it explains {:.0} % of what varies, but at about {},{},{}, where it explains {:.0} %: \
         measure its middle and radius in the video again", explained[0], better[0], better[1], better[2], explained[1])]
    Misplaced {
        /// Where it is said to be.
        given: ProbePlace,
        /// Middle and radius of a circle that fits clearly better, pixels.
        better: [f64; 3],
        /// The parts of the variation that both explain, percent.
        explained: [f64; 2],
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
    pub(crate) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| Self::Write { path, source }
    }
}

impl From<CapturedObjectError> for TurnError {
    fn from(error: CapturedObjectError) -> Self {
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
