//! What can go wrong when a turn is recorded or recovered.

use std::io;
use std::path::PathBuf;

use relit_data::disk::is_full;
use relit_data::session;
use relit_video::VideoError;

/// Why a recording could not begin, be finished, or be recovered. What ends a recording early is no
/// such error: see [`super::EndReason`].
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A thread could not be started, or a folder of sessions could not be listed.
    #[error("{what}")]
    System {
        /// What could not be done, and what to do.
        what: String,
        /// The system's answer.
        source: io::Error,
    },
    /// A thread panicked.
    #[error(
        "the {0} thread failed, which is an error in this program; the session is recovered at the next start"
    )]
    Panicked(&'static str),
    /// The session folder could not be made, written or read.
    #[error(transparent)]
    Session(#[from] session::SessionError),
    /// The video could not be made, written or read.
    #[error(transparent)]
    Video(#[from] VideoError),
    /// A recovered session does not read back.
    #[error(
        "{folder} was recovered to {wanted} frames and {found} read back: look at its video with `ffprobe`"
    )]
    NotMended {
        /// The session folder.
        folder: PathBuf,
        /// Frames that it should have.
        wanted: usize,
        /// Frames that it has.
        found: usize,
    },
}

impl RecordingError {
    /// True where a disk, quota or file size limit is exhausted.
    pub fn is_out_of_space(&self) -> bool {
        match self {
            Self::Video(VideoError::DiskFull { .. }) => true,
            Self::Session(session::SessionError::Io { source, .. }) => is_full(source),
            _ => false,
        }
    }
}
