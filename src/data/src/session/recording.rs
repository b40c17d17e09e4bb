//! The input of the programs: a session folder, or a bare video.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use super::{
    FrameIndex, INDEX_FILE, MANIFEST_FILE, MASK_FILE, Manifest, SessionError, Status,
    is_session_name, object_of,
};
use crate::counts::count_of;
use crate::file_names::{composed, is_hidden, is_video};

/// The longest name of a recording that is made from a file name, bytes.
const MAX_ID_LENGTH: usize = 120;

/// What a folder has that is a data set.
const DATASET_FILE: &str = "dataset.json";

/// Something about a recording that its user should know.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Notice {
    /// Worth a look; nothing is lost.
    Warning(String),
    /// Something that was recorded, or should have been, is missing.
    Loss(String),
}

impl Notice {
    /// The text, one sentence.
    pub fn text(&self) -> &str {
        match self {
            Self::Warning(text) | Self::Loss(text) => text,
        }
    }

    /// True if something is lost.
    pub fn is_loss(&self) -> bool {
        matches!(self, Self::Loss(_))
    }
}

/// One recorded turn: the video and what is known of it.
#[derive(Debug, Clone)]
pub struct Recording {
    /// The session's name.
    pub id: String,
    /// The object's name.
    pub object: String,
    /// The session folder; `None` for a bare video file.
    pub folder: Option<PathBuf>,
    /// The video file.
    pub video: PathBuf,
    /// The manifest; `None` for a bare video.
    pub manifest: Option<Manifest>,
    /// The frame index, if there is one.
    pub frames: Option<FrameIndex>,
    /// What the user should know.
    pub notices: Vec<Notice>,
}

impl Recording {
    /// Opens a session folder or a bare video file. Of the video only the size is checked.
    ///
    /// # Errors
    /// [`SessionError`] if manifest or index are not usable, the session has not ended, or it has no video.
    /// What is incomplete but usable becomes a [`Notice`].
    pub fn open(path: &Path) -> Result<Self, SessionError> {
        if path.is_dir() {
            if path.join(MANIFEST_FILE).exists() {
                return Self::open_session(path);
            }
            return Self::open_plain_folder(path);
        }
        if !path.is_file() {
            return Err(not_there(path));
        }
        Ok(Self::bare(path, path.file_stem(), None))
    }

    fn open_session(folder: &Path) -> Result<Self, SessionError> {
        let manifest = Manifest::read(folder)?;
        let mut notices = Vec::new();
        match &manifest.status {
            Status::Complete => {}
            Status::Recording => {
                let what = "is marked as still recording: wait for the capture to end, let the capture program recover it, or give the video file itself";
                return Err(SessionError::unusable(folder, what));
            }
            Status::Aborted(reason) => {
                notices.push(Notice::Loss(format!("the capture was aborted: {reason}")));
            }
        }
        if manifest.status != Status::Complete && manifest.video.frames == Some(0) {
            return Err(SessionError::NoFrames(folder.to_owned()));
        }
        let video = folder.join(&manifest.video.file);
        let found = match fs::metadata(&video) {
            Ok(data) if data.is_file() => data.len(),
            _ => return Err(video_missing(&video)),
        };
        if let Some(recorded) = manifest.video.bytes
            && recorded != found
        {
            let file = &manifest.video.file;
            notices.push(Notice::Loss(format!(
                "{file} has {found} bytes, but the manifest says {recorded}: it was truncated or changed"
            )));
        }
        for fault in &manifest.faults {
            notices.push(Notice::Warning(format!(
                "during the capture: {}",
                fault.what
            )));
        }
        let frames = read_index(folder, &manifest, &mut notices)?;
        Ok(Self {
            id: manifest.id.clone(),
            object: manifest.object.clone(),
            folder: Some(folder.to_owned()),
            video,
            manifest: Some(manifest),
            frames,
            notices,
        })
    }

    fn open_plain_folder(folder: &Path) -> Result<Self, SessionError> {
        let mut videos = videos_in(folder)?;
        match (videos.pop(), videos.len()) {
            (None, _) => Err(no_session(folder)),
            (Some(video), 0) => {
                // A path such as "." has no usable name.
                let real = folder.canonicalize().unwrap_or_else(|_| folder.to_owned());
                let mut recording = Self::bare(&video, real.file_name(), Some(folder));
                recording.notices.push(Notice::Warning(
                    "the folder has no session.json: its video is used without angles and without the driver's time stamps".to_owned(),
                ));
                Ok(recording)
            }
            (Some(_), more) => {
                let what = format!(
                    "has no session.json and {} video files: give the video file instead of the folder",
                    more + 1
                );
                Err(SessionError::unusable(folder, &what))
            }
        }
    }

    fn bare(video: &Path, name: Option<&OsStr>, folder: Option<&Path>) -> Self {
        let id = name_from(name);
        Self {
            object: object_of(&id).to_owned(),
            id,
            folder: folder.map(Path::to_owned),
            video: video.to_owned(),
            manifest: None,
            frames: None,
            notices: Vec::new(),
        }
    }
}

/// The recordings at a path: the path itself for a session folder, a video file, or a folder with one video; for a
/// folder of sessions or of several videos each of them, sorted by name. A session folder that has lost its manifest or
/// its video, and a folder that cannot be looked into, are listed too, so that opening them reports it.
///
/// # Errors
/// [`SessionError::Unusable`] if there is none; or [`SessionError::Io`].
pub fn recordings(path: &Path) -> Result<Vec<PathBuf>, SessionError> {
    if !path.exists() {
        return Err(not_there(path));
    }
    if path.is_file() || path.join(MANIFEST_FILE).exists() {
        return Ok(vec![path.to_owned()]);
    }
    if !path.is_dir() {
        return Err(no_session(path));
    }
    let mut inner = Vec::new();
    for entry in fs::read_dir(path).map_err(SessionError::io(path, "listed"))? {
        let folder = entry.map_err(SessionError::io(path, "listed"))?.path();
        // One that cannot be listed may hold a session: opening it says why not, and the others go on.
        if folder.is_dir() && !is_hidden(&folder) && is_session_folder(&folder).unwrap_or(true) {
            inner.push(folder);
        }
    }
    let videos = videos_in(path)?;
    match (videos.len(), inner.len()) {
        (0, 0) => Err(no_session(path)),
        // The recording has the name of the folder.
        (1, 0) => Ok(vec![path.to_owned()]),
        _ => {
            inner.extend(videos);
            inner.sort();
            Ok(inner)
        }
    }
}

/// As [`recordings`], where a folder with one video, and no session, stands for that clip: whoever has a folder of masks
/// names them by clips, also where there is only one.
///
/// # Errors
/// As there.
pub fn clips(path: &Path) -> Result<Vec<PathBuf>, SessionError> {
    let found = recordings(path)?;
    let is_plain_folder = path.is_dir() && !path.join(MANIFEST_FILE).exists();
    if is_plain_folder && found == [path] {
        videos_in(path)
    } else {
        Ok(found)
    }
}

/// What lies beside the recordings in a folder of sessions or videos, sorted by name: neither what is hidden nor data
/// sets.
///
/// # Errors
/// [`SessionError::Io`].
pub fn beside_recordings(folder: &Path) -> Result<Vec<PathBuf>, SessionError> {
    let mut beside = Vec::new();
    for entry in fs::read_dir(folder).map_err(SessionError::io(folder, "listed"))? {
        let path = entry.map_err(SessionError::io(folder, "listed"))?.path();
        let is_known = if path.is_dir() {
            path.join(DATASET_FILE).exists() || is_session_folder(&path).unwrap_or(true)
        } else {
            is_video(&path)
        };
        if !is_known && !is_hidden(&path) {
            beside.push(path);
        }
    }
    beside.sort();
    Ok(beside)
}

/// Folders of recordings in a folder that [`recordings`] takes for the one video in it.
pub fn hidden_recordings(folder: &Path) -> Vec<PathBuf> {
    let is_recording = !folder.is_dir() || folder.join(MANIFEST_FILE).exists();
    let beside = if is_recording {
        Vec::new()
    } else {
        beside_recordings(folder).unwrap_or_default()
    };
    let holds_recordings = |path: &PathBuf| path.is_dir() && recordings(path).is_ok();
    beside.into_iter().filter(holds_recordings).collect()
}

fn not_there(path: &Path) -> SessionError {
    SessionError::Unusable(format!(
        "{} does not exist: give a session folder, a folder of sessions, or a video file",
        path.display()
    ))
}

fn no_session(folder: &Path) -> SessionError {
    let what = "holds no session (no session.json, no video file, and no folders that have one): give another folder";
    SessionError::unusable(folder, what)
}

pub(super) fn video_missing(video: &Path) -> SessionError {
    let what = "is missing, but the session's manifest names it: put it back";
    SessionError::unusable(video, what)
}

/// Whether a folder is a session, complete or not.
fn is_session_folder(folder: &Path) -> Result<bool, SessionError> {
    let parts = [MANIFEST_FILE, INDEX_FILE, MASK_FILE];
    Ok(parts.iter().any(|part| folder.join(part).exists()) || !videos_in(folder)?.is_empty())
}

fn videos_in(folder: &Path) -> Result<Vec<PathBuf>, SessionError> {
    let mut videos = Vec::new();
    for entry in fs::read_dir(folder).map_err(SessionError::io(folder, "listed"))? {
        let path = entry.map_err(SessionError::io(folder, "listed"))?.path();
        // A link that leads nowhere is a video, too: opening it says so.
        if is_video(&path) && !path.is_dir() {
            videos.push(path);
        }
    }
    videos.sort();
    Ok(videos)
}

/// The name that the recording at a path has, as far as it can be seen without reading more than the manifest.
pub fn recording_name(path: &Path) -> String {
    if !path.is_dir() {
        return name_from(path.file_stem());
    }
    match Manifest::read(path) {
        Ok(manifest) => manifest.id,
        Err(_) => {
            let real = path.canonicalize();
            name_from(real.as_deref().unwrap_or(path).file_name())
        }
    }
}

/// A session's name made from a file name: invalid characters become '_'.
fn name_from(name: Option<&OsStr>) -> String {
    let name = composed(&name.unwrap_or_default().to_string_lossy());
    let mut id: String = name
        .chars()
        .map(|c| {
            if is_session_name(c.encode_utf8(&mut [0; 4])) || c == '.' {
                c
            } else {
                '_'
            }
        })
        .collect();
    while id.len() > MAX_ID_LENGTH {
        id.pop();
    }
    let kept = id.trim_end_matches('.').len();
    id.replace_range(kept.., &"_".repeat(id.len() - kept));
    if is_session_name(&id) {
        return id;
    }
    // It is empty, hidden, or the name of a device.
    let mut id = format!("_{}", id.trim_start_matches('.'));
    while id.len() > MAX_ID_LENGTH {
        id.pop();
    }
    id
}

fn read_index(
    folder: &Path,
    manifest: &Manifest,
    notices: &mut Vec<Notice>,
) -> Result<Option<FrameIndex>, SessionError> {
    let path = folder.join(INDEX_FILE);
    if !path.exists() {
        notices.push(Notice::Loss(format!(
            "{INDEX_FILE} is missing: angles and the driver's time stamps are lost"
        )));
        return Ok(None);
    }
    let bytes = fs::read(&path).map_err(SessionError::io(&path, "read"))?;
    let index = FrameIndex::parse(&bytes).map_err(|fault| {
        let what = format!(
            "is damaged: {fault}; repair that line, or give the video file itself to go on without angles"
        );
        SessionError::unusable(&path, &what)
    })?;
    if index.is_truncated() {
        notices.push(Notice::Loss(format!(
            "the last line of {INDEX_FILE} is incomplete and lost"
        )));
    }
    let counted = index.entries().len() as u64;
    if let Some(recorded) = manifest.video.frames
        && recorded != counted
    {
        notices.push(Notice::Loss(format!(
            "{INDEX_FILE} has {counted} frames, but the manifest says {recorded}"
        )));
    }
    for gap in index.gaps() {
        notices.push(Notice::Loss(format!(
            "the camera dropped {} before frame {}",
            count_of(gap.missing, "frame"),
            gap.before
        )));
    }
    Ok(Some(index))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_name_becomes_a_session_name() {
        let name = |text: &str| name_from(Some(OsStr::new(text)));
        assert_eq!(name("mug 2 (blue)"), "mug_2__blue_");
        assert_eq!(name("20261120T093015Z-mug"), "20261120T093015Z-mug");
        assert_eq!(name(".hidden"), "_hidden");
        assert_eq!(name(""), "_");
        assert_eq!(name("mug.."), "mug__");
        assert_eq!(name("CON"), "_CON");
        assert_eq!(name("aux.2"), "_aux.2");
        assert_eq!(name("cafe\u{301}"), "caf\u{e9}");
        assert_eq!(name("cup%d:1?*[x]"), "cup_d_1___x_");
        assert_eq!(name("-x"), "-x");
        for long in [
            "x".repeat(200),
            format!("con.{}", "x".repeat(200)),
            ".".repeat(200),
        ] {
            assert!(is_session_name(&name(&long)), "{long}");
        }
        assert!(is_session_name(&name(&"ä".repeat(200))));
    }
}
