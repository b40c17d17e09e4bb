//! Why a turn cannot be solved.

use std::io;
use std::path::Path;

use relight_core::files::FolderFault;
use relight_core::image::ImageError;
use relight_core::light::LightError;
use relight_core::reader::ReadError;
use relight_photo::decompose::DecomposeError;
use relight_photo::nets::NetError;
use relit_data::session::SessionError;

/// Why a turn cannot be solved, or what was found cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum TurnError {
    /// The shard cannot be opened.
    #[error(transparent)]
    Open(#[from] ReadError),
    /// The folder of the results cannot be read or written.
    #[error(transparent)]
    Folder(#[from] FolderFault),
    /// Any other fault, as a sentence.
    #[error("{0}")]
    Refused(String),
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
    /// The session whose video shows the ball cannot be read.
    #[error(transparent)]
    Session(#[from] SessionError),
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
}

impl TurnError {
    /// A setting is beyond what is allowed.
    pub(crate) fn setting(what: &str, value: f64, allowed: &str) -> Self {
        Self::Refused(format!("{what} is {value}: it has to be {allowed}"))
    }

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

/// A coefficient of the light is not finite.
impl From<LightError> for TurnError {
    fn from(_: LightError) -> Self {
        Self::NoLight
    }
}
