//! Why a turn cannot be solved.

use std::io;
use std::path::{Path, PathBuf};

use relight_core::captured_object::CapturedObjectError;
use relight_core::files::FolderFault;
use relight_core::image::ImageError;
use relight_core::light::LightError;
use relight_core::reader::OpenError;
use relight_photo::decompose::DecomposeError;
use relight_photo::files::MovieError;
use relight_photo::nets::NetError;
use relit_data::session::SessionError;

/// Why a turn cannot be solved, or what was found cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TurnError {
    /// The shard cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The shard is damaged, and the rest of it cannot be solved.
    #[error("{} is damaged ({damage}), and the rest of it cannot be solved", path.display())]
    Damaged {
        /// The shard.
        path: PathBuf,
        /// The first damage.
        damage: String,
        /// Why the rest cannot be solved.
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
    /// The frames do not make a turn, or a folder or a video is not the required one.
    #[error("{0}")]
    Refused(String),
    /// A setting is beyond what may be given.
    #[error("{what} is {value}: it has to be {allowed}")]
    Setting {
        /// Which setting.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What may be given.
        allowed: &'static str,
    },
    /// No light fits the curves.
    #[error(
        "no light fits the turn: it is all dark or all clipped; change the exposure and capture it again"
    )]
    NoLight,
    /// The network of turns fails.
    #[error(transparent)]
    Network(#[from] NetError),
    /// The network of photographs fails.
    #[error("the network of photographs cannot estimate the albedo")]
    Decompose(#[from] DecomposeError),
    /// An image or a light cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The object cannot be made a file.
    #[error("the captured object cannot be written")]
    Asset(#[source] Box<CapturedObjectError>),
    /// The session whose video shows the ball cannot be read.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The session of a shard is not next to its data set.
    #[error("the session or video from which {} was made is not next to its data set: give it with --session", .0.display())]
    NoSession(PathBuf),
    /// The ball is under the object's mask.
    #[error(
        "the object's mask covers {percent:.0} % of the ball at {given}: measure the ball's place again, or remove the ball \
         from the mask"
    )]
    BallInMask {
        /// The place that was given.
        given: String,
        /// The part of the ball that is covered.
        percent: f64,
    },
    /// The circle shows no ball.
    #[error(
        "the circle at {given} shows no ball: its light explains {explained:.0} % of the variation; measure it again, uncover \
         the ball, and check its material"
    )]
    NoBall {
        /// The place that was given.
        given: String,
        /// The part that is explained, percent.
        explained: f64,
    },
    /// The ball is elsewhere.
    #[error("the ball is not at {given} ({:.0} % explained) but near {},{},{} ({:.0} % explained): measure its centre and \
         radius in the video again", explained[0], better[0], better[1], better[2], explained[1])]
    Misplaced {
        /// The place that was given.
        given: String,
        /// Middle and radius of a circle that fits clearly better, pixels.
        better: [f64; 3],
        /// The parts of the variation that both explain, percent.
        explained: [f64; 2],
    },
    /// A video cannot be read or written.
    #[error(transparent)]
    Movie(#[from] MovieError),
}

impl TurnError {
    /// A video is not that of the turn, with the difference.
    pub(crate) fn other_video(path: &Path, why: &str) -> Self {
        let path = path.display();
        Self::Refused(format!(
            "{path} is not the turn's video: {why}; give the session from which the shard was made"
        ))
    }

    /// Puts the path to an operating system's reason.
    pub(crate) fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        |source| FolderFault::Write(path, source).into()
    }
}

impl From<CapturedObjectError> for TurnError {
    fn from(error: CapturedObjectError) -> Self {
        Self::Asset(Box::new(error))
    }
}

/// A coefficient of the light is not finite.
impl From<LightError> for TurnError {
    fn from(_: LightError) -> Self {
        Self::NoLight
    }
}

impl From<FolderFault> for TurnError {
    fn from(fault: FolderFault) -> Self {
        Self::Refused(match fault {
            FolderFault::Foreign(path, name) => format!(
                "{} holds {name}, which is not a result of a turn: give a folder that is new, empty, or holds an earlier result",
                path.display()
            ),
            FolderFault::NoFolder(path) => format!(
                "{} cannot be the folder for the results: give the name of a folder, not of a file",
                path.display()
            ),
            FolderFault::Read(path, source) => {
                format!("{} cannot be read: {source}", path.display())
            }
            FolderFault::Write(path, source) => {
                format!("{} cannot be written: {source}", path.display())
            }
        })
    }
}
