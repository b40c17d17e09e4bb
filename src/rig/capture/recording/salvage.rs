//! Bringing sessions to their end whose recorder died: killed, crashed, or without power.
//!
//! Nothing is deleted. The video stays as it is: what follows its last whole frame is passed over by
//! every reader. The index is cut to the frames that the video holds, and stays as it was found under
//! another name. The manifest tells what happened.

use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

use super::error::RecordingError;
use relit_data::causes::with_causes;
use relit_data::session::{self, FrameIndex, InterruptedSession, MANIFEST_FILE, Manifest, Status};
use relit_video::Video;

/// How many frames at the end are tried until one decodes. A power cut can leave blocks of the last
/// half second without their content.
const TRIED_AT_END: usize = 64;

/// What was saved of a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Saved {
    /// Frames that video and index hold.
    pub frames: usize,
    /// The time that they cover, seconds.
    pub seconds: f64,
    /// Lines of the index whose frames did not reach the disk.
    pub lines_cut: usize,
}

impl fmt::Display for Saved {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            frames, seconds, ..
        } = self;
        match frames {
            0 => f.write_str("no frame reached the disk"),
            1 => f.write_str("1 frame is there"),
            _ => write!(f, "{frames} frames, {seconds:.1} seconds"),
        }
    }
}

/// A session that was found interrupted.
#[derive(Debug)]
pub struct Salvaged {
    /// The session folder.
    pub folder: PathBuf,
    /// What was saved, or why it could not be.
    pub saved: Result<Saved, RecordingError>,
}

impl fmt::Display for Salvaged {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let folder = self.folder.display();
        match &self.saved {
            Ok(saved) => write!(
                f,
                "{folder} was interrupted, and is kept as aborted: {saved}"
            ),
            Err(error) => {
                let why = with_causes(error);
                write!(
                    f,
                    "{folder} was interrupted and could not be salvaged: {why}"
                )
            }
        }
    }
}

/// Looks for interrupted sessions in a folder of sessions and brings each to its end. Those that are
/// being recorded by a living process are left alone.
///
/// # Errors
/// [`RecordingError::List`] where the folder cannot be looked through. What goes wrong with one session
/// stands in its [`Salvaged`].
pub fn salvage(root: &Path) -> Result<Vec<Salvaged>, RecordingError> {
    let failed = |source| RecordingError::List {
        path: root.to_owned(),
        source,
    };
    let mut folders = Vec::new();
    for entry in fs::read_dir(root).map_err(failed)? {
        let folder = entry.map_err(failed)?.path();
        if says_recording(&folder) {
            folders.push(folder);
        }
    }
    folders.sort();
    let salvaged = folders.into_iter().filter_map(|folder| {
        let saved = match salvage_session(&folder) {
            Err(RecordingError::Session(
                session::SessionError::InUse(_) | session::SessionError::Ended(_),
            )) => {
                return None;
            }
            saved => saved,
        };
        Some(Salvaged { folder, saved })
    });
    Ok(salvaged.collect())
}

/// Brings one interrupted session to its end.
///
/// # Errors
/// [`session::SessionError::InUse`] where its recorder lives, [`session::SessionError::Ended`] where there is
/// nothing to do, [`RecordingError::NotMended`], or what the file system answers; its status stays
/// "recording" then, but for [`RecordingError::NotMended`].
pub fn salvage_session(folder: &Path) -> Result<Saved, RecordingError> {
    let unended = InterruptedSession::open(folder)?;
    let entries = unended.index().entries();
    let frames = whole_frames(&unended.video_path()).min(entries.len());
    let seconds = match entries.get(..frames) {
        Some([first, .., last]) => last.t_us.saturating_sub(first.t_us) as f64 / 1e6,
        _ => 0.0,
    };
    let saved = Saved {
        frames,
        seconds,
        lines_cut: entries.len() - frames,
    };
    let reason = match frames {
        0 => "recording was interrupted before its first frame was on the disk".to_owned(),
        _ => format!("recording was interrupted: {saved}"),
    };
    unended.abort(frames, &reason)?;
    verify(folder, frames)?;
    Ok(saved)
}

/// How many frames from the first on can be had; 0 where there is no video yet.
pub(super) fn whole_frames(path: &Path) -> usize {
    let Ok(video) = Video::open(path) else {
        return 0;
    };
    let all = video.frames().len();
    let decodes = |number: &usize| video.frame(*number as u64).is_ok();
    // A damaged frame in the middle is no end: only those behind which nothing is whole.
    let last = (0..all).rev().take(TRIED_AT_END).find(decodes);
    last.map_or(all.saturating_sub(TRIED_AT_END), |last| last + 1)
}

/// Reads the session back as any user of it would.
fn verify(folder: &Path, wanted: usize) -> Result<(), RecordingError> {
    if wanted == 0 {
        return Ok(());
    }
    let recording = session::Recording::open(folder)?;
    let lines = recording
        .frames
        .as_ref()
        .map_or(0, |index: &FrameIndex| index.entries().len());
    let frames = Video::open(&recording.video)?.frames().len();
    let found = lines.min(frames);
    if found != wanted || lines != wanted {
        let folder = folder.to_owned();
        return Err(RecordingError::NotMended {
            folder,
            wanted,
            found,
        });
    }
    Ok(())
}

/// A quick look, to be looked at again once the session is claimed.
fn says_recording(folder: &Path) -> bool {
    let manifest = fs::read(folder.join(MANIFEST_FILE)).ok();
    manifest
        .and_then(|bytes| Manifest::from_json(&bytes).ok())
        .is_some_and(|manifest| manifest.status == Status::Recording)
}
