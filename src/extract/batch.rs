//! Several recordings into one data set: one after the other, each noted when it is done with.

use std::collections::HashMap;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};

use rayon::{ThreadPool, ThreadPoolBuilder};

use relit_data::file_names::folded;
use relit_data::session::{self, beside_sessions, recording_name, recordings};
use relit_data::shard::OutputFolder;

use super::catalog::Catalog;
use super::job::Job;
use super::storage::StorageBackend;
use super::{ExtractError, ExtractOptions, Observer, RecordingOutcome, Tally};

/// Extracts the recordings `found` into the folder `out`, and adds the outcomes to `tally`.
pub(super) fn extract_recordings(
    found: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
    storage: &dyn StorageBackend,
    mut tally: Tally,
) -> Result<Tally, ExtractError> {
    if out.join(session::MANIFEST_FILE).exists() {
        return Err(ExtractError::IntoSession(out.to_owned()));
    }
    let folder = match options.task {
        None => OutputFolder::lock(out)?,
        Some(task) => OutputFolder::lock_for(out, task)?,
    };
    let pool = ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()?;
    let mut run = Run {
        catalog: Catalog::open(&folder, found, options)?,
        folder,
        options,
        pool,
        names: HashMap::new(),
        observer,
        storage,
    };
    for (position, recording) in found.iter().enumerate() {
        if options.task.is_none_or(|task| task.takes(position)) {
            run.extract(position, recording, &mut tally)?;
        } else if recording.exists() {
            // Another task may be at it right now: of two names that are alike, the first is extracted, whoever has it.
            let name = recording_name(recording);
            run.names.entry(folded(&name)).or_insert(name);
        }
    }
    Ok(tally)
}

/// All recordings in the inputs, in the order in which tasks share them; inputs without any are reported, and so is, by one
/// task, what lies beside sessions.
pub(super) fn find(
    inputs: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
    tally: &mut Tally,
) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut report = |path: &Path, outcome: RecordingOutcome| {
        tally.count(&outcome);
        observer.ended(path, &outcome);
    };
    for input in inputs {
        let inside = recordings(input);
        let is_folder_of_sessions = inside
            .as_ref()
            .is_ok_and(|inside| inside != std::slice::from_ref(input));
        if is_folder_of_sessions && options.task.is_none_or(|task| task.takes(0)) {
            for path in beside_sessions(input).unwrap_or_default() {
                let mask = options.mask.as_ref();
                if !is_same(&path, out) && !mask.is_some_and(|mask| is_same(&path, mask)) {
                    report(&path, RecordingOutcome::LeftOut(ExtractError::NoRecording));
                }
            }
        }
        match inside {
            Ok(inside) => found.extend(inside),
            Err(error) => report(input, RecordingOutcome::of(Err(error.into()))),
        }
    }
    found
}

fn is_same(path: &Path, other: &Path) -> bool {
    let [path, other] = [path, other].map(|path| path.canonicalize().ok());
    path.is_some() && path == other
}

/// One extraction into one data set.
struct Run<'a> {
    folder: OutputFolder,
    catalog: Catalog,
    options: &'a ExtractOptions,
    pool: ThreadPool,
    /// Names of the recordings so far, by what they are where case is ignored.
    names: HashMap<String, String>,
    observer: &'a dyn Observer,
    storage: &'a dyn StorageBackend,
}

impl Run<'_> {
    /// Extracts a recording and notes the outcome; an error if a task's outcome cannot be noted.
    fn extract(
        &mut self,
        position: usize,
        recording: &Path,
        tally: &mut Tally,
    ) -> Result<(), ExtractError> {
        // What a panic leaves behind of this recording lies under temporary names.
        let extracted = panic::catch_unwind(AssertUnwindSafe(|| self.extract_one(recording)));
        let outcome = RecordingOutcome::of(extracted.unwrap_or(Err(ExtractError::Panic)));
        tally.count(&outcome);
        self.observer.ended(recording, &outcome);
        self.catalog.note(&self.folder, position, &outcome)?;
        let extracted = match &outcome {
            RecordingOutcome::Extracted(entry) => Some(entry.id.as_str()),
            _ => None,
        };
        self.storage
            .ended(recording, self.catalog.dataset(), extracted)
    }

    fn extract_one(&mut self, path: &Path) -> Result<RecordingOutcome, ExtractError> {
        let Self {
            folder, options, ..
        } = self;
        let local = self.storage.fetch(path)?;
        let job = Job::open(&local, options)?;
        let id = job.id().to_owned();
        if let Some(other) = self.names.get(&folded(&id)) {
            return Err(match *other == id {
                true => ExtractError::SameName(id),
                false => ExtractError::NameAlike {
                    id,
                    other: other.clone(),
                },
            });
        }
        self.names.insert(folded(&id), id);
        let dataset = self.catalog.dataset();
        if let Some(other) = job.alike(dataset) {
            return Err(ExtractError::NameAlike {
                id: job.id().to_owned(),
                other: other.to_owned(),
            });
        }
        if options.resume
            && let Some(entry) = job.existing_entry(dataset, options)
            && self.storage.holds(dataset, folder.path(), job.id())
        {
            return Ok(RecordingOutcome::Skipped(Box::new(entry.clone())));
        }
        if !options.replace && job.would_replace_another(dataset) {
            let (out, id) = (folder.path().to_owned(), job.id().to_owned());
            return Err(ExtractError::NameTaken { out, id });
        }
        if options.task.is_some() {
            folder.clear_leftovers_of(job.id())?;
        }
        self.observer.started(path, options.frames);
        let (entry, shards) = job.run(folder, options, &self.pool, self.observer)?;
        self.catalog.add(folder, entry.clone(), shards)?;
        Ok(RecordingOutcome::Extracted(Box::new(entry)))
    }
}
