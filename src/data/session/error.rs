//! The errors of reading and writing sessions.

use std::io;
use std::path::PathBuf;

use super::frames::IndexFault;
use super::manifest::ManifestFault;

/// Why a session could not be read or written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The path does not exist.
    #[error("there is no {0}: give a session folder, a folder of sessions, or a video file")]
    NotThere(PathBuf),
    /// A folder without manifest, video or sessions.
    #[error(
        "{0} holds no session (no session.json, no video file, and no folders that have one): give another folder"
    )]
    NoSession(PathBuf),
    /// A folder without manifest that holds several videos.
    #[error(
        "{folder} has no session.json and {count} video files: give the video file instead of the folder"
    )]
    SeveralVideos {
        /// The folder.
        folder: PathBuf,
        /// Number of videos in it.
        count: usize,
    },
    /// A folder of sessions that holds a video too.
    #[error(
        "{folder} holds sessions and also the video {video}: give the sessions by name, or move the video away"
    )]
    VideoAmongSessions {
        /// The folder.
        folder: PathBuf,
        /// The first video in it.
        video: PathBuf,
    },
    /// The manifest does not follow the format.
    #[error(
        "{path} is not a usable manifest: {fault}; repair it, or give the video file itself to go on without it"
    )]
    Manifest {
        /// The manifest's path.
        path: PathBuf,
        /// What is wrong in it.
        fault: ManifestFault,
    },
    /// The frame index does not follow the format.
    #[error(
        "{path} is damaged: {fault}; repair that line, or give the video file itself to go on without angles"
    )]
    Index {
        /// The index's path.
        path: PathBuf,
        /// What is wrong in it.
        fault: IndexFault,
    },
    /// The session has not ended.
    #[error(
        "{0} is marked as still recording: wait for the capture to end, let the capture program salvage it, or give the video file itself"
    )]
    StillRecording(PathBuf),
    /// The video that the manifest names does not exist.
    #[error("{0} is missing, but the session's manifest names it: put it back")]
    VideoMissing(PathBuf),
    /// The capture ended before its first frame.
    #[error("{0} has 0 frames: the capture ended before the first one")]
    NoFrames(PathBuf),
    /// A session of this name exists.
    #[error("{0} exists already: a session never replaces another one")]
    Exists(PathBuf),
    /// Another process has locked the session.
    #[error("{0} is being recorded by another process: wait for it to end")]
    InUse(PathBuf),
    /// The session has ended already.
    #[error("{0} is not marked as still recording: there is nothing to salvage")]
    Ended(PathBuf),
    /// The name is not a valid session name.
    #[error(
        "{0:?} cannot be a session's name: use letters, digits, '-', '_' and '.', at most 120 bytes, neither starting nor ending with '.', and no device's name of Windows such as con"
    )]
    BadName(String),
    /// An entry that does not continue the index.
    #[error("frame {n} cannot follow in {path}: {fault}")]
    BadEntry {
        /// The index's path.
        path: PathBuf,
        /// The entry's number.
        n: u64,
        /// What is wrong with it.
        fault: IndexFault,
    },
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
