//! The errors of an extraction.

use std::io;
use std::path::{Path, PathBuf};

use relit_data::{session, shard};
use relit_video as video;

/// Why a recording, or all of them, could not be extracted.
#[derive(Debug, thiserror::Error)]
pub enum ExtractError {
    /// It cannot be done as it is requested: what is wrong, with what, and the way out.
    #[error("{0}")]
    Refused(String),
    /// The recording holds too little of a turn.
    #[error("{0}")]
    TooLittle(String),
    /// The video has a single frame.
    #[error("the video has one usable frame only: give a recording of a turn")]
    OneFrame,
    /// The table did not turn.
    #[error(
        "the table turned by only {degrees:.2} degrees: to spread the frames over time, give the video file itself"
    )]
    TableStands {
        /// Angle from the first frame to the last, degrees.
        degrees: f64,
    },
    /// The mask cannot be held against the video.
    #[error(transparent)]
    MaskWarnings(#[from] relit_grabcut::MaskError),
    /// The recording cannot be used.
    #[error(transparent)]
    Session(#[from] session::SessionError),
    /// The video cannot be used.
    #[error(transparent)]
    Video(#[from] video::VideoError),
    /// The data set cannot be written.
    #[error(transparent)]
    Shard(#[from] shard::ShardError),
    /// The report cannot be made.
    #[error("the report cannot be made")]
    Report(#[from] image::ImageError),
    /// A file on the local disk cannot be read or written.
    #[error("{path} could not be {doing}: {source}")]
    Io {
        /// What was attempted.
        doing: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

impl ExtractError {
    /// For `map_err`: an I/O error with what was attempted and the path.
    pub(super) fn io(doing: &'static str, path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_owned();
        move |source| Self::Io {
            doing,
            path,
            source,
        }
    }

    /// The error as it is for a capture that was aborted, whose table did turn.
    pub(super) fn into_aborted_capture(self) -> Self {
        let covered = match self {
            Self::OneFrame => 0.0,
            Self::TableStands { degrees } => degrees,
            other => return other,
        };
        Self::TooLittle(format!(
            "the frames cover {covered:.1} of 360 degrees, which is too little: record it again"
        ))
    }

    /// Whether the recording itself is the reason: it holds too little of a turn, and is left out.
    pub fn skips_recording(&self) -> bool {
        matches!(
            self,
            Self::TooLittle(_) | Self::Session(session::SessionError::NoFrames(_))
        )
    }
}
