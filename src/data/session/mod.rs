//! What a capture leaves on disk: the session folder with its manifest (`session.json`), its frame
//! index (`frames.jsonl`) and its video. Reading, writing, and the errors that a damaged one gives.
//!
//! This room knows the files and what they promise each other. It decodes no video and knows
//! nothing of cameras, masks or shards. A video file without a session folder is taken too: it is
//! a [`Recording`] without manifest and frame index.

mod claim;
mod frames;
mod manifest;
mod recording;
mod unended;
mod writer;

use std::io;
use std::path::PathBuf;

pub use crate::naming::is_session_name;
pub use claim::Claim;
pub use frames::{FrameEntry, FrameIndex, Gap, IndexFault};
pub use manifest::{
    CameraFacts, Fault, FrameClock, MANIFEST_SCHEMA, Manifest, ManifestFault, SoftwareFacts,
    Status, TurntableFacts, VideoFacts, object_of,
};
pub use recording::{Notice, Recording, recordings};
pub use unended::Unended;
pub use writer::SessionWriter;

/// Name of the manifest in a session folder.
pub const MANIFEST_FILE: &str = "session.json";
/// Name of the frame index in a session folder.
pub const INDEX_FILE: &str = "frames.jsonl";
/// Name of the mask in a session folder.
pub const MASK_FILE: &str = "mask.png";

/// Why a session could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The path leads nowhere.
    #[error("there is no {0}: give a session folder, a folder of sessions, or a video file")]
    NotThere(PathBuf),
    /// A folder without manifest, video or sessions.
    #[error(
        "{0} holds no session, neither a session.json, nor a video file, nor folders that have one: give another folder"
    )]
    NoSession(PathBuf),
    /// A folder without manifest that holds several videos.
    #[error(
        "{folder} has no session.json and {count} video files: name the one that is meant instead of the folder"
    )]
    SeveralVideos {
        /// The folder.
        folder: PathBuf,
        /// How many videos it holds.
        count: usize,
    },
    /// A folder of sessions with a video of its own.
    #[error(
        "{folder} holds sessions and the video {video} beside them: give the sessions by name, or move the video away"
    )]
    VideoAmongSessions {
        /// The folder.
        folder: PathBuf,
        /// The first video in it.
        video: PathBuf,
    },
    /// The manifest is not what the format says.
    #[error(
        "{path} is not a usable manifest: {fault}; mend it, or give the video file itself to go on without it"
    )]
    Manifest {
        /// The manifest's path.
        path: PathBuf,
        /// What is wrong in it.
        fault: ManifestFault,
    },
    /// The frame index is not what the format says.
    #[error(
        "{path} is damaged: {fault}; mend that line, or give the video file itself to go on without angles"
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
    /// The manifest names a video that is not there.
    #[error("{0} is missing, though the session's manifest names it: put it back")]
    VideoMissing(PathBuf),
    /// A session of this name stands there already.
    #[error("{0} is there already: a session is never written over another")]
    Exists(PathBuf),
    /// Another process records there, or works on it.
    #[error("{0} is being recorded by another process: wait for it to end")]
    InUse(PathBuf),
    /// The session has ended already.
    #[error("{0} is not marked as still recording: there is nothing to bring to an end")]
    Ended(PathBuf),
    /// The name cannot be a session's.
    #[error(
        "{0:?} cannot be a session's name: use letters, digits, '-', '_' and '.', at most 120 bytes, not starting with '.'"
    )]
    BadName(String),
    /// An entry was pushed that does not continue the index.
    #[error("frame {n} cannot follow in {path}: {fault}")]
    BadEntry {
        /// The index's path.
        path: PathBuf,
        /// The entry's number.
        n: u64,
        /// What is wrong with it.
        fault: IndexFault,
    },
    /// The file system refused.
    #[error(
        "{path} could not be {doing}: check that it is there, that it may be read and written, and that the disk has room"
    )]
    Io {
        /// What was worked on.
        path: PathBuf,
        /// What was to be done, as a participle: "read".
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
}

impl Error {
    fn io(path: impl Into<PathBuf>, doing: &'static str) -> impl FnOnce(io::Error) -> Self {
        let path = path.into();
        move |source| Self::Io {
            path,
            doing,
            source,
        }
    }
}
