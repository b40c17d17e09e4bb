//! Closing sessions whose recorder died: killed, crashed, or without power.
//!
//! Nothing is deleted. The video stays as it is: readers ignore what follows its last whole frame.
//! The index is cut to the frames that the video holds, and kept as it was found under another name.
//! The manifest says what happened. The frames get their angles from what the table had reported.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::{fmt, io};

use super::error::RecordingError;
use relit_data::causes::with_causes;
use relit_data::session::{InterruptedSession, Manifest, Recording, SessionError, Status};
use relit_video::Video;

use relit_turntable::AngleFit;

/// How many frames at the end are tried until one decodes. A power cut can leave blocks of the last
/// half second without their content.
const TRIED_AT_END: usize = 64;

/// What was saved of a session.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RecoveryReport {
    /// Frames that video and index hold.
    pub frames: usize,
    /// The time that they cover, seconds.
    pub seconds: f64,
    /// Lines of the index whose frames did not reach the disk.
    pub lines_cut: usize,
}

impl fmt::Display for RecoveryReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.frames {
            0 => f.write_str("no frame reached the disk"),
            1 => f.write_str("1 frame is there"),
            frames => write!(f, "{frames} frames, {:.1} seconds", self.seconds),
        }
    }
}

/// A session that was found interrupted.
#[derive(Debug)]
pub struct RecoveredSession {
    /// The session folder.
    pub folder: PathBuf,
    /// What was saved, or why it could not be.
    pub saved: Result<RecoveryReport, RecordingError>,
}

impl fmt::Display for RecoveredSession {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} was interrupted", self.folder.display())?;
        match &self.saved {
            Ok(saved) => write!(f, ", and is kept as aborted: {saved}"),
            Err(error) => write!(f, " and could not be recovered: {}", with_causes(error)),
        }
    }
}

/// Looks for interrupted sessions in a folder of sessions and closes them. Those that a living
/// process is recording are not changed.
///
/// # Errors
/// [`RecordingError::System`] if the folder cannot be listed. What goes wrong with one session
/// is in its [`RecoveredSession`].
pub fn recover(root: &Path) -> Result<Vec<RecoveredSession>, RecordingError> {
    let failed = |source| RecordingError::System {
        what: format!(
            "{} could not be listed: check that it is there and may be read",
            root.display()
        ),
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
    let recovered = folders.into_iter().filter_map(|folder| {
        let saved = recover_session(&folder);
        let other =
            |error: &SessionError| matches!(error, SessionError::InUse(_) | SessionError::Ended(_));
        match &saved {
            Err(RecordingError::Session(error)) if other(error) => None,
            _ => Some(RecoveredSession { folder, saved }),
        }
    });
    Ok(recovered.collect())
}

/// Closes one interrupted session.
///
/// # Errors
/// [`SessionError::InUse`] if its recorder lives, [`SessionError::Ended`] if there is nothing
/// to do, [`RecordingError::NotMended`], or what the file system answers; its status stays
/// "recording" then, except for [`RecordingError::NotMended`].
pub fn recover_session(folder: &Path) -> Result<RecoveryReport, RecordingError> {
    let session = InterruptedSession::open(folder)?;
    let entries = session.index().entries();
    let frames = whole_frames(&session.video_path())?.min(entries.len());
    let seconds = match entries.get(..frames) {
        Some([first, .., last]) => last.t_us.saturating_sub(first.t_us) as f64 / 1e6,
        _ => 0.0,
    };
    let saved = RecoveryReport {
        frames,
        seconds,
        lines_cut: entries.len() - frames,
    };
    let reason = match frames {
        0 => "recording was interrupted before its first frame was on the disk".to_owned(),
        _ => format!("recording was interrupted: {saved}"),
    };
    let track = session
        .journal()
        .and_then(|journal| AngleFit::from_reports(&journal.turn, &journal.reports));
    let angle = |t_us| track.as_ref()?.angle_at(t_us);
    session.abort(frames, &angle, &reason)?;
    verify(folder, frames)?;
    Ok(saved)
}

/// How many frames from the first on are readable; 0 before the video exists, and where no video was begun in its file.
///
/// # Errors
/// If the file cannot be read now: then nobody knows.
pub(super) fn whole_frames(path: &Path) -> Result<usize, RecordingError> {
    let unread = |source| RecordingError::System {
        what: format!(
            "{} could not be read: check its disk; the session is recovered at the next start",
            path.display()
        ),
        source,
    };
    let mut file = match File::open(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(0),
        opened => opened.map_err(unread)?,
    };
    let video = match Video::open(path) {
        Ok(video) => video,
        Err(error) if path.to_str().is_none() => return Err(error.into()),
        Err(_) => {
            io::copy(&mut file, &mut io::sink()).map_err(unread)?;
            return Ok(0);
        }
    };
    let all = video.frames().len();
    let decodes = |number: &usize| video.frame(*number as u64).is_ok();
    // A damaged frame in the middle is kept: only damaged ones at the end are left out.
    let last = (0..all).rev().take(TRIED_AT_END).find(decodes);
    Ok(last.map_or(all.saturating_sub(TRIED_AT_END), |last| last + 1))
}

/// Reads a session with frames back as any user of it would.
fn verify(folder: &Path, wanted: usize) -> Result<(), RecordingError> {
    if wanted == 0 {
        return Ok(());
    }
    let recording = Recording::open(folder)?;
    let index = recording.frames.as_ref();
    let lines = index.map_or(0, |index| index.entries().len());
    let frames = Video::open(&recording.video)?.frames().len();
    if lines == wanted && frames >= wanted {
        return Ok(());
    }
    Err(RecordingError::NotMended {
        folder: folder.to_owned(),
        wanted,
        found: lines.min(frames),
    })
}

/// Whether the manifest says so now; it is read again once the session is locked.
fn says_recording(folder: &Path) -> bool {
    Manifest::read(folder).is_ok_and(|manifest| manifest.status == Status::Recording)
}
