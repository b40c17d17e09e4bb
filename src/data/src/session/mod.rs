//! The session folder that a capture writes: its manifest (`session.json`), its frame index
//! (`frames.jsonl`) and its video.
//!
//! - Reading: [`recordings`] lists the sessions at a path, [`Recording::open`] reads one. A video file
//!   without a session folder is accepted too: it is a [`Recording`] without manifest and frame
//!   index.
//! - Writing: [`SessionWriter`], which holds the folder's lock (`lock`).
//! - [`TurnJournal`]: what the turntable reported, until the index has the angles.
//! - Recovery of what a killed recorder left behind: [`InterruptedSession`].
//!
//! This module knows the files and how they relate. It decodes no video and knows nothing of
//! cameras, masks or shards.

mod annotations;
mod error;
mod frames;
mod interrupted;
mod journal;
mod lock;
mod manifest;
mod masks;
mod recording;
mod writer;

pub use crate::naming::is_session_name;
pub use annotations::annotate;
pub use error::SessionError;
pub use frames::{FrameEntry, FrameIndex, Gap, is_possible_angle};
pub use interrupted::InterruptedSession;
pub use journal::{JOURNAL_FILE, TurnJournal};
use lock::SessionLock;
pub use manifest::{
    CameraFacts, Fault, FrameClock, MANIFEST_SCHEMA, Manifest, SoftwareFacts, Status,
    TurntableFacts, VideoFacts, object_of,
};
pub use masks::{MASK_SUFFIX, mask_in, mask_stem};
pub use recording::{
    Notice, Recording, beside_recordings, clips, hidden_recordings, recording_name, recordings,
};
pub use writer::SessionWriter;

/// Name of the manifest in a session folder.
pub const MANIFEST_FILE: &str = "session.json";
/// Name of the frame index in a session folder.
pub const INDEX_FILE: &str = "frames.jsonl";
/// Name of the mask in a session folder.
pub const MASK_FILE: &str = "mask.png";
