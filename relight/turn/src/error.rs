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
    /// The frames do not make a turn, or a folder or a video is another than what is needed: why.
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
    #[error("no light explains the turn: all of it is dark, or all of it is clipped")]
    NoLight,
    /// The network of turns fails.
    #[error(transparent)]
    Network(#[from] NetError),
    /// The network of photographs fails.
    #[error("the network of photographs cannot tell the albedo")]
    Decompose(#[from] DecomposeError),
    /// An image or a light cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The object cannot be made a file.
    #[error("the object cannot be written as a file that can be lit")]
    Asset(#[source] Box<CapturedObjectError>),
    /// The session whose video shows the ball cannot be read.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The session from which a shard was made is not near it.
    #[error("no session or video of which {} was made lies beside its data set: give it with --session", .0.display())]
    NoSession(PathBuf),
    /// The ball is under the object's mask.
    #[error(
        "the object's mask covers {percent:.0} % of the ball at {given}: measure the ball's place in the video again, or take the ball out of the mask"
    )]
    BallInMask {
        /// Where it is said to be.
        given: String,
        /// The part of the ball that is covered.
        percent: f64,
    },
    /// There is no ball.
    #[error(
        "the circle at {given} shows no ball: the light by it explains {explained:.0} % of what varies in it; measure the ball's middle and radius in the video again, \
         check that nothing covers it, and say what the ball is made of"
    )]
    NoBall {
        /// Where it is said to be.
        given: String,
        /// The part that is explained, percent.
        explained: f64,
    },
    /// The ball is elsewhere.
    #[error("the ball is not at {given}, where the light by it explains {:.0} % of what varies, but at about {},{},{}, where it explains {:.0} %: \
         measure its middle and radius in the video again", explained[0], better[0], better[1], better[2], explained[1])]
    Misplaced {
        /// Where it is said to be.
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
    /// That a video is not that of the turn, and what tells them apart.
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

/// A light of which a coefficient is not finite is none.
impl From<LightError> for TurnError {
    fn from(_: LightError) -> Self {
        Self::NoLight
    }
}

impl From<FolderFault> for TurnError {
    fn from(fault: FolderFault) -> Self {
        Self::Refused(match fault {
            FolderFault::Foreign(path, name) => format!(
                "{} holds {name}, which is no result of a turn: give a folder that is new, empty, or holds an earlier result",
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
