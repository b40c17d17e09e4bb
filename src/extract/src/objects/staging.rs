//! The folder on the local disk through which recordings and data sets of object stores pass.

use std::cell::RefCell;
use std::collections::HashMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use relit_data::session;
use relit_data::shard::{self, ArrayTask, Dataset, MergedDataset, ShardError};
use tempfile::TempDir;

use super::bucket::{Bucket, not_there};
use super::url::{check, is_url};
use crate::batch::{StorageBackend, extract_recordings, into_session, recordings_in};
use crate::{ExtractError, ExtractOptions, ExtractSummary, Observer, RecordingOutcome};

/// As [`extract`](crate::extract), where some of the inputs or `out` are URLs.
pub(crate) fn extract(
    inputs: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
) -> Result<ExtractSummary, ExtractError> {
    for url in inputs.iter().map(PathBuf::as_path).chain([out]) {
        if is_url(url) {
            check(url)?;
        }
    }
    let folder = temporary()?;
    let target = if is_url(out) {
        Some(Target::open(out, folder.path(), options.task)?)
    } else {
        None
    };
    let local = target
        .as_ref()
        .map_or(out, |target| &target.folder)
        .to_owned();
    let mut staging = Staging {
        sources: HashMap::new(),
        target,
    };
    let (mut found, mut summary) = (Vec::new(), ExtractSummary::default());
    for (number, input) in inputs.iter().enumerate() {
        let into = folder.path().join(format!("in-{number}"));
        match staging.recordings(input, &into, options) {
            Ok(inside) => found.extend(inside),
            Err(error) => {
                let outcome = RecordingOutcome::from_result(Err(error));
                summary.count(&outcome);
                observer.ended(input, None, &outcome);
            }
        }
    }
    let summary = extract_recordings(&found, &local, options, observer, &staging, summary)?;
    if let Some(target) = &staging.target {
        target.describe()?;
    }
    Ok(summary)
}

/// The description of the data set at a URL.
pub(super) fn described(out: &Path) -> Result<(Dataset, Option<String>), ExtractError> {
    let (bucket, folder) = with_descriptions(out)?;
    let url = bucket.url("");
    let read = shard::read_partial(folder.path());
    let (dataset, problem) = read.map_err(|error| named_by_url(error, &url))?;
    let local = folder.path().display().to_string();
    Ok((dataset, problem.map(|text| text.replace(&local, &url))))
}

/// A data set at a URL, and a folder with its descriptions.
fn with_descriptions(out: &Path) -> Result<(Bucket, TempDir), ExtractError> {
    let (bucket, folder) = (Bucket::open(out)?, temporary()?);
    for (name, _) in bucket.list()? {
        if name == Dataset::FILE || is_piece(&name) {
            bucket.download(&name, &folder.path().join(&name))?;
        }
    }
    Ok((bucket, folder))
}

/// Joins the pieces of several tasks at a URL.
pub(super) fn merge(out: &Path) -> Result<MergedDataset, ExtractError> {
    let (bucket, folder) = with_descriptions(out)?;
    let length = |file: &str| match bucket.length(file) {
        Ok(Some(length)) => Ok(length),
        // A folder of images, of which no length is asked.
        Ok(None) if bucket.holds_any(file).unwrap_or(false) => Ok(0),
        Ok(None) => Err(io::Error::new(io::ErrorKind::NotFound, "it is not there")),
        Err(error) => Err(io::Error::other(error)),
    };
    let merged = shard::merge(folder.path(), &length)
        .map_err(|error| named_by_url(error, &bucket.url("")))?;
    bucket.upload(&folder.path().join(Dataset::FILE), Dataset::FILE)?;
    Ok(merged)
}

/// An error of the data set on the local disk as that of the one at the URL.
fn named_by_url(error: ShardError, url: &str) -> ExtractError {
    let path = PathBuf::from(url);
    match error {
        ShardError::NoDataset(_) => ShardError::NoDataset(path).into(),
        ShardError::PartialManifests { problems, .. } => {
            ShardError::PartialManifests { path, problems }.into()
        }
        other => other.into(),
    }
}

fn is_piece(name: &str) -> bool {
    let inside = name.strip_prefix("tasks/");
    inside.is_some_and(|piece| !piece.starts_with('.') && piece.ends_with(".json"))
}

/// A folder that is removed in the end, where the system puts temporary files.
fn temporary() -> Result<TempDir, ExtractError> {
    let mut name = tempfile::Builder::new();
    let made = name.prefix("relit-extract-").tempdir();
    made.map_err(ExtractError::io("made", &std::env::temp_dir()))
}

/// A recording in an object store.
struct Remote {
    bucket: Rc<Bucket>,
    /// The names of its files, and where they go.
    files: Vec<(String, PathBuf)>,
    /// The recording on the local disk.
    local: PathBuf,
}

/// What passes through the folder.
struct Staging {
    /// By the names under which they are extracted; those that are not here are on the local disk.
    sources: HashMap<PathBuf, Remote>,
    target: Option<Target>,
}

impl Staging {
    /// The recordings in an input. Those of a URL are found as on disk, by empty files of the same names.
    fn recordings(
        &mut self,
        input: &Path,
        into: &Path,
        options: &ExtractOptions,
    ) -> Result<Vec<PathBuf>, ExtractError> {
        if !is_url(input) {
            return Ok(recordings_in(input, options)?);
        }
        let bucket = Rc::new(Bucket::open(input)?);
        let shown = bucket.url("");
        let root = into.join(shown.rsplit('/').next().unwrap_or_default());
        let files = bucket.list()?;
        if files.is_empty() {
            return Err(not_there(&shown));
        }
        let place = |name: &str| match name {
            "" => root.clone(),
            name => root.join(name),
        };
        for (name, _) in files
            .iter()
            .filter(|(name, _)| name.split('/').count() <= 2)
        {
            placeholder(&place(name)).map_err(ExtractError::io("made", &root))?;
        }
        let mut found = Vec::new();
        for local in recordings_in(&root, options)? {
            let inside = local.strip_prefix(&root).unwrap_or(Path::new(""));
            let name = PathBuf::from(bucket.url(&inside.to_string_lossy()));
            let files = files.iter().map(|(name, _)| (name.clone(), place(name)));
            let files = files
                .filter(|(_, place)| place == &local || place.parent() == Some(local.as_path()));
            let remote = Remote {
                bucket: Rc::clone(&bucket),
                files: files.collect(),
                local,
            };
            self.sources.insert(name.clone(), remote);
            found.push(name);
        }
        Ok(found)
    }
}

fn placeholder(path: &Path) -> io::Result<()> {
    fs::create_dir_all(path.parent().unwrap_or(path))?;
    fs::write(path, b"")
}

impl StorageBackend for Staging {
    fn fetch(&self, recording: &Path) -> Result<PathBuf, ExtractError> {
        let Some(remote) = self.sources.get(recording) else {
            return Ok(recording.to_owned());
        };
        for (name, place) in &remote.files {
            remote.bucket.download(name, place)?;
        }
        Ok(remote.local.clone())
    }

    fn holds(&self, dataset: &Dataset, out: &Path, session: &str) -> bool {
        match &self.target {
            None => dataset.check_integrity(out, session).is_ok(),
            Some(target) => target.holds(dataset, session).unwrap_or(false),
        }
    }

    fn ended(
        &self,
        recording: &Path,
        dataset: &Dataset,
        extracted: Option<&str>,
    ) -> Result<(), ExtractError> {
        if let Some(remote) = self.sources.get(recording) {
            for (_, place) in &remote.files {
                fs::remove_file(place).map_err(ExtractError::io("removed", place))?;
            }
        }
        if let Some((target, session)) = self.target.as_ref().zip(extracted) {
            target.deliver(dataset, session)?;
        }
        Ok(())
    }
}

/// A data set in an object store.
struct Target {
    bucket: Bucket,
    /// Where it is written first.
    folder: PathBuf,
    /// The description: `dataset.json`, or a task's piece.
    description: String,
    /// The description that was uploaded last.
    described: RefCell<Vec<u8>>,
}

impl Target {
    /// The data set at `url`; its description is downloaded.
    fn open(url: &Path, folder: &Path, task: Option<ArrayTask>) -> Result<Self, ExtractError> {
        let bucket = Bucket::open(url)?;
        // A bucket that does not exist is noticed before anything is extracted.
        bucket.holds_any("")?;
        if bucket.length(session::MANIFEST_FILE)?.is_some() {
            return Err(into_session(url));
        }
        let target = Self {
            bucket,
            folder: folder.join("out"),
            description: task.map_or(Dataset::FILE.to_owned(), ArrayTask::file),
            described: RefCell::default(),
        };
        let place = target.folder.join(&target.description);
        if target.bucket.length(&target.description)?.is_some() {
            target.bucket.download(&target.description, &place)?;
        }
        Ok(target)
    }

    /// Whether all files of a session are there with their lengths.
    fn holds(&self, dataset: &Dataset, session: &str) -> Result<bool, ExtractError> {
        for (file, bytes) in dataset.files_of(session) {
            let there = match bytes {
                Some(bytes) => self.bucket.length(file)? == Some(bytes),
                None => self.bucket.holds_any(file)?,
            };
            if !there {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Uploads the files of a session, then the description, and removes the files from the local disk.
    fn deliver(&self, dataset: &Dataset, session: &str) -> Result<(), ExtractError> {
        let files: Vec<&str> = dataset.files_of(session).map(|(file, _)| file).collect();
        for file in &files {
            let place = self.folder.join(file);
            if place.is_dir() {
                let inside = fs::read_dir(&place).map_err(ExtractError::io("listed", &place))?;
                for image in inside {
                    let image = image.map_err(ExtractError::io("listed", &place))?;
                    let name = format!("{file}/{}", image.file_name().to_string_lossy());
                    self.bucket.upload(&image.path(), &name)?;
                }
            } else {
                self.bucket.upload(&place, file)?;
            }
        }
        self.describe()?;
        for file in files {
            let place = self.folder.join(file);
            let removed = if place.is_dir() {
                fs::remove_dir_all(&place)
            } else {
                fs::remove_file(&place)
            };
            removed.map_err(ExtractError::io("removed", &place))?;
        }
        Ok(())
    }

    /// Uploads the description, if it changed.
    fn describe(&self) -> Result<(), ExtractError> {
        let place = self.folder.join(&self.description);
        let bytes = match fs::read(&place) {
            Ok(bytes) => bytes,
            // Nothing was extracted.
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
            Err(error) => return Err(ExtractError::io("read", &place)(error)),
        };
        if *self.described.borrow() != bytes {
            self.bucket.upload(&place, &self.description)?;
            self.described.replace(bytes);
        }
        Ok(())
    }
}
