//! Where the session is from which a shard was made.

use std::path::{Path, PathBuf};

use relit_data::session::Recording;

use crate::observe::reading::ReadTurn;

/// The folder in which sessions are beside data sets. By convention of `relit-capture`.
const SESSIONS: &str = "sessions";

/// The session that the shard's records name, where it lies beside the shard or its folder, or in `sessions` there;
/// none where it is not there, or has no video.
#[must_use]
pub fn session_of(shard: &Path, turn: &ReadTurn) -> Option<PathBuf> {
    let session = &turn.origin.as_ref()?.session;
    let shard = std::path::absolute(shard).ok()?;
    shard
        .ancestors()
        .skip(1)
        .take(2)
        .flat_map(|folder| [folder.join(session), folder.join(SESSIONS).join(session)])
        .find(|path| path.is_dir() && *path != shard && Recording::open(path).is_ok())
}
