//! The sessions on disk, as a list and one by one. Reads manifests and frame indexes, no video.

use std::convert::Infallible;
use std::path::{Path, PathBuf};
use std::{fs, io};

use axum::http::StatusCode;
use serde::Serialize;

use super::cache::{Cache, FileVersion};
use crate::processing::results::{CHECK_PAGE, SessionResults, entries_in, results_of};
use relit_data::causes::with_causes;
use relit_data::naming::is_session_name;
use relit_data::session::{
    self, FrameIndex, INDEX_FILE, MANIFEST_FILE, MASK_FILE, Manifest, Status, object_of,
};
use relit_data::shard::Dataset;
use relit_web::Failure;

/// Longest note, characters.
const MAX_NOTE_LENGTH: usize = 2000;
/// Summaries that are kept.
const SUMMARIES: usize = 4096;

/// How far a session has come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum SessionStatus {
    /// Being written, or waiting to be recovered.
    Recording,
    /// Whole.
    Complete,
    /// Ended early.
    Aborted,
    /// Its manifest cannot be read.
    Unreadable,
}

/// A session in the list.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SessionSummary {
    /// Its name.
    pub(super) id: String,
    /// The object's name.
    pub(super) object: String,
    /// When the capture began, RFC 3339.
    pub(super) created: Option<String>,
    pub(super) status: SessionStatus,
    /// Why it is not whole.
    pub(super) reason: Option<String>,
    /// What else to know of the whole take, such as light that is too even.
    pub(super) notes: Vec<String>,
    /// Frames in the video.
    pub(super) frames: Option<u64>,
    /// Frames that the camera counted and the video lacks.
    pub(super) dropped: Option<u64>,
    /// From the first frame to the last, seconds.
    pub(super) duration_s: Option<f64>,
    /// What a person noted.
    pub(super) note: Option<String>,
    /// How a person rated it, 1 to 5.
    pub(super) rating: Option<u8>,
    /// What was made of it; `null` in the trash.
    pub(super) results: Option<SessionResults>,
}

/// All that is known of a session.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct SessionDetail {
    #[serde(flatten)]
    pub(super) summary: SessionSummary,
    /// The manifest, `session.json`.
    pub(super) manifest: serde_json::Value,
    /// Whether it has a mask.
    pub(super) has_mask: bool,
    /// Each frame's time, seconds after the first.
    pub(super) times_s: Vec<f64>,
    /// Each frame's angle, degrees; `null` without a table.
    pub(super) angles_deg: Vec<Option<f64>>,
}

/// The video of a session that has ended.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) struct VideoFile {
    pub(super) path: PathBuf,
    version: FileVersion,
}

/// The sessions under one folder.
pub(super) struct Library {
    pub(super) root: PathBuf,
    /// Where their data set is.
    dataset: PathBuf,
    /// Summaries by folder, and the version of the manifest that each was made from.
    summaries: Cache<(PathBuf, FileVersion), SessionSummary>,
}

impl Library {
    pub(super) fn new(root: PathBuf, dataset: PathBuf) -> Self {
        Self {
            root,
            dataset,
            summaries: Cache::new(SUMMARIES),
        }
    }

    /// Up to `most` sessions, newest first, from those whose names come before `before` and begin with the `day`.
    pub(super) fn list(
        &self,
        before: Option<&str>,
        day: Option<&str>,
        most: usize,
    ) -> Result<Vec<SessionSummary>, Failure> {
        let mut names = self.names()?;
        names.retain(|name| before.is_none_or(|before| name.as_str() < before));
        names.retain(|name| day.is_none_or(|day| name.starts_with(day)));
        names.truncate(most);
        let made = entries_in(&self.dataset);
        let listed = names.iter().filter_map(|name| {
            let mut summary = self.summary(&self.root, name)?;
            summary.results = Some(results_of(&self.root.join(name), &made));
            Some(summary)
        });
        Ok(listed.collect())
    }

    /// Names of all session folders, newest first: they begin with the date.
    fn names(&self) -> Result<Vec<String>, Failure> {
        let mut names = read_names(&self.root).map_err(|error| {
            let root = self.root.display();
            Failure::internal(format!(
                "the folder of sessions {root} cannot be read: {error}"
            ))
        })?;
        names.sort_unstable_by(|one, other| other.cmp(one));
        Ok(names)
    }

    /// The summary of a session, without what was made of it. `None` if it has gone meanwhile.
    pub(super) fn summary(&self, root: &Path, name: &str) -> Option<SessionSummary> {
        let folder = root.join(name);
        let version = FileVersion::read(&folder.join(MANIFEST_FILE))?;
        let key = (folder.clone(), version);
        let summary = self.summaries.get_or_make(key, |_| {
            Ok::<_, Infallible>(match read_manifest(&folder) {
                Ok(manifest) => {
                    let index = read_index(&folder, &manifest);
                    summarise(name, &manifest, index.as_ref())
                }
                Err(reason) => unreadable(name, reason),
            })
        });
        summary.ok()
    }

    /// All about one session.
    pub(super) fn detail(&self, id: &str) -> Result<SessionDetail, Failure> {
        let folder = self.folder(id)?;
        let manifest = read_manifest(&folder).map_err(Failure::internal)?;
        let index = read_index(&folder, &manifest);
        let mut summary = summarise(id, &manifest, index.as_ref());
        summary.results = Some(results_of(&folder, &entries_in(&self.dataset)));
        let json = manifest
            .to_json()
            .and_then(|bytes| serde_json::from_slice(&bytes).map_err(|error| error.to_string()));
        let index = index.unwrap_or_default();
        let entries = index.entries();
        let first = entries.first().map_or(0, |entry| entry.t_us);
        Ok(SessionDetail {
            summary,
            manifest: json.map_err(Failure::internal)?,
            has_mask: folder.join(MASK_FILE).is_file(),
            times_s: entries
                .iter()
                .map(|entry| seconds(first, entry.t_us))
                .collect(),
            angles_deg: entries.iter().map(|entry| entry.angle_deg).collect(),
        })
    }

    /// The video of a session that is not being recorded.
    pub(super) fn video_file(&self, id: &str) -> Result<VideoFile, Failure> {
        let folder = self.ended(id)?;
        let manifest = read_manifest(&folder).map_err(Failure::internal)?;
        let path = folder.join(&manifest.video.file);
        let missing = || Failure::not_found(format!("the video of {id} is missing"));
        let version = FileVersion::read(&path).ok_or_else(missing)?;
        Ok(VideoFile { path, version })
    }

    /// Whether there is a session of that name.
    pub(super) fn has(&self, id: &str) -> bool {
        self.folder(id).is_ok()
    }

    /// The folder of a session that is not being recorded.
    pub(super) fn ended(&self, id: &str) -> Result<PathBuf, Failure> {
        let folder = self.folder(id)?;
        match read_manifest(&folder) {
            Ok(manifest) if manifest.status == Status::Recording => {
                let error = format!("{id} is still being recorded: wait for its end");
                Err(Failure::new(StatusCode::CONFLICT, error))
            }
            // One that cannot be read can still be had as it is.
            _ => Ok(folder),
        }
    }

    /// A session's mask.
    pub(super) fn mask(&self, id: &str) -> Result<Vec<u8>, Failure> {
        let path = self.folder(id)?.join(MASK_FILE);
        fs::read(path).map_err(|_| Failure::not_found(format!("{id} has no mask")))
    }

    /// The page about the check of a session's mask.
    pub(super) fn check_page(&self, id: &str) -> Result<Vec<u8>, Failure> {
        let path = self.folder(id)?.join(CHECK_PAGE);
        fs::read(path).map_err(|_| Failure::not_found(format!("the mask of {id} was not checked")))
    }

    /// The page about a session in the data set.
    pub(super) fn report_page(&self, id: &str) -> Result<Vec<u8>, Failure> {
        self.folder(id)?;
        let path = self.dataset.join(format!("{id}.html"));
        fs::read(path).map_err(|_| Failure::not_found(format!("{id} is not in the data set")))
    }

    /// The file with a session's samples in the data set.
    pub(super) fn shard_file(&self, id: &str) -> Result<PathBuf, Failure> {
        self.folder(id)?;
        let folder = &self.dataset;
        let dataset = Dataset::read(folder).ok();
        let shard = dataset.and_then(|dataset| {
            let mut shards = dataset.shards_of(id);
            shards.next().map(|shard| folder.join(&shard.file))
        });
        let shard = shard.filter(|path| path.is_file());
        shard.ok_or_else(|| Failure::not_found(format!("{id} has no shard: extract it first")))
    }

    /// Writes note and rating of a session to its manifest.
    pub(super) fn annotate(
        &self,
        id: &str,
        note: Option<&str>,
        rating: Option<u8>,
    ) -> Result<(), Failure> {
        if note.is_some_and(|note| note.chars().count() > MAX_NOTE_LENGTH) {
            let error = format!("a note has at most {MAX_NOTE_LENGTH} characters");
            return Err(Failure::bad_request(error));
        }
        if rating.is_some_and(|rating| !(1..=5).contains(&rating)) {
            return Err(Failure::bad_request("a rating is a number from 1 to 5"));
        }
        let note = note.map(str::trim).filter(|note| !note.is_empty());
        let written = session::annotate(&self.ended(id)?, note, rating);
        written.map_err(|error| Failure::internal(with_causes(&error)))
    }

    /// A session's folder. A name with which one could leave the root is nobody's.
    fn folder(&self, id: &str) -> Result<PathBuf, Failure> {
        let folder = self.root.join(id);
        if is_session_name(id) && folder.join(MANIFEST_FILE).is_file() {
            Ok(folder)
        } else {
            Err(Failure::not_found("no session has that name"))
        }
    }
}

/// The names of the sessions in a folder.
pub(super) fn read_names(root: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(root)? {
        let entry = entry?;
        if let Ok(name) = entry.file_name().into_string()
            && is_session_name(&name)
            && entry.path().join(MANIFEST_FILE).is_file()
        {
            names.push(name);
        }
    }
    Ok(names)
}

fn read_manifest(folder: &Path) -> Result<Manifest, String> {
    Manifest::read(folder).map_err(|error| with_causes(&error))
}

/// The frame index of a session that has ended. A damaged one counts as none: the programs that need it
/// say what is wrong with it.
fn read_index(folder: &Path, manifest: &Manifest) -> Option<FrameIndex> {
    if manifest.status == Status::Recording {
        return None;
    }
    let bytes = fs::read(folder.join(INDEX_FILE)).ok()?;
    FrameIndex::parse(&bytes).ok()
}

fn summarise(id: &str, manifest: &Manifest, index: Option<&FrameIndex>) -> SessionSummary {
    let (status, reason) = match &manifest.status {
        Status::Recording => (SessionStatus::Recording, None),
        Status::Complete => (SessionStatus::Complete, None),
        Status::Aborted(reason) => (SessionStatus::Aborted, Some(reason.clone())),
    };
    let ends = index.and_then(|index| Some((index.entries().first()?, index.entries().last()?)));
    let counted = index.map(|index| index.entries().len() as u64);
    let missing = |index: &FrameIndex| {
        let gaps = index.gaps().into_iter();
        gaps.fold(0_u64, |sum, gap| sum.saturating_add(gap.missing))
    };
    SessionSummary {
        id: id.to_owned(),
        object: manifest.object.clone(),
        created: Some(manifest.created.to_string()),
        status,
        reason,
        notes: manifest.notes(),
        frames: manifest.video.frames.or(counted),
        dropped: index.map(missing),
        duration_s: ends.map(|(first, last)| seconds(first.t_us, last.t_us)),
        note: manifest.note.clone(),
        rating: manifest.rating,
        results: None,
    }
}

fn unreadable(id: &str, reason: String) -> SessionSummary {
    SessionSummary {
        id: id.to_owned(),
        object: object_of(id).to_owned(),
        created: None,
        status: SessionStatus::Unreadable,
        reason: Some(reason),
        notes: Vec::new(),
        frames: None,
        dropped: None,
        duration_s: None,
        note: None,
        rating: None,
        results: None,
    }
}

fn seconds(from_us: i64, to_us: i64) -> f64 {
    to_us.saturating_sub(from_us) as f64 / 1e6
}
