//! The errors of reading and writing sessions.

use std::io;
use std::path::{Path, PathBuf};

/// Why a session could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// A session cannot be used or written: what is wrong, and what to do.
    #[error("{0}")]
    Unusable(String),
    /// The capture ended before its first frame.
    #[error("{0} has 0 frames: the capture ended before the first one")]
    NoFrames(PathBuf),
    /// Another process has locked the session.
    #[error("{0} is being recorded by another process: wait for it to end")]
    InUse(PathBuf),
    /// The session has ended already.
    #[error("{0} is not marked as still recording: there is nothing to recover")]
    Ended(PathBuf),
    /// A file could not be read or written.
    #[error(
        "{path} could not be {doing}: check that it exists, that it may be read and written, and that the disk has space"
    )]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What was attempted, as a participle: "read".
        doing: &'static str,
        /// The system's error.
        source: io::Error,
    },
}

impl SessionError {
    /// That a file or folder of a session is not what it should be: what, as the rest of a sentence.
    pub(super) fn unusable(path: &Path, what: &str) -> Self {
        Self::Unusable(format!("{} {what}", path.display()))
    }

    /// That a manifest does not follow the format.
    pub(super) fn manifest(path: &Path, fault: &str) -> Self {
        let what = format!(
            "is not a usable manifest: {fault}; repair it, or give the video file itself to go on without it"
        );
        Self::unusable(path, &what)
    }

    /// For `map_err`: an I/O error with the path and what was attempted.
    pub(super) fn io(
        path: impl Into<PathBuf>,
        doing: &'static str,
    ) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io {
            path,
            doing,
            source,
        }
    }
}
