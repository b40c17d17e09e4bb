//! Several recordings into one data set: one after the other, each noted when it is done with.

use std::collections::HashMap;
use std::panic::{self, AssertUnwindSafe};
use std::path::{Path, PathBuf};

use rayon::{ThreadPool, ThreadPoolBuilder};

use relit_data::file_names::folded;
use relit_data::session::{
    self, SessionError, beside_recordings, clips, hidden_recordings, recording_name, recordings,
};
use relit_data::shard::{Dataset, OutputFolder};

use super::dataset_index::DatasetIndex;
use super::job::Job;
use super::{ExtractError, ExtractOptions, ExtractSummary, Observer, RecordingOutcome};

/// Brings recordings to the local disk, and takes extracted sessions away from there; `()` leaves everything where it is.
pub(super) trait StorageBackend {
    /// The recording as a file or folder on the local disk.
    fn fetch(&self, recording: &Path) -> Result<PathBuf, ExtractError> {
        Ok(recording.to_owned())
    }

    /// Whether the files of a session that the data set lists are as it says; `out` is the folder on the local
    /// disk.
    fn holds(&self, dataset: &Dataset, out: &Path, session: &str) -> bool {
        dataset.check_integrity(out, session).is_ok()
    }

    /// The recording is done with, and what became of it is noted. `extracted` is the session that it was
    /// extracted to just now.
    fn ended(&self, _: &Path, _: &Dataset, _extracted: Option<&str>) -> Result<(), ExtractError> {
        Ok(())
    }
}

impl StorageBackend for () {}

/// Extracts the recordings `found` into the folder `out`, and adds the outcomes to `summary`.
pub(super) fn extract_recordings(
    found: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
    storage: &dyn StorageBackend,
    mut summary: ExtractSummary,
) -> Result<ExtractSummary, ExtractError> {
    if out.join(session::MANIFEST_FILE).exists() {
        return Err(into_session(out));
    }
    let folder = match options.task {
        None => OutputFolder::lock(out)?,
        Some(task) => OutputFolder::lock_for(out, task)?,
    };
    let pool = ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()
        .map_err(|error| {
            ExtractError::Refused(format!("the worker threads could not be started: {error}"))
        })?;
    let mut run = Run {
        catalog: DatasetIndex::open(&folder, found, options)?,
        earlier: DatasetIndex::earlier(out, options)?,
        folder,
        options,
        pool,
        names: HashMap::new(),
        observer,
        storage,
    };
    let takes = |position: &usize| options.task.is_none_or(|task| task.takes(*position));
    observer.planned((0..found.len()).filter(takes).count());
    for (position, recording) in found.iter().enumerate() {
        if options.task.is_none_or(|task| task.takes(position)) {
            run.extract(position, recording, &mut summary)?;
        } else if recording.exists() {
            // Another task may be at it right now: of two names that are alike, the first is extracted, whoever has it.
            let name = recording_name(recording);
            run.names.entry(folded(&name)).or_insert(name);
        }
    }
    Ok(summary)
}

pub(super) fn into_session(out: &Path) -> ExtractError {
    ExtractError::Refused(format!(
        "{} is a session folder: give another one for the data set",
        out.display()
    ))
}

/// All recordings in the inputs, in the order in which tasks share them; inputs without any are reported, and so is, by one
/// task, what lies beside recordings.
pub(super) fn find(
    inputs: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
    summary: &mut ExtractSummary,
) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut report = |path: &Path, outcome: RecordingOutcome| {
        summary.count(&outcome);
        observer.ended(path, None, &outcome);
    };
    for input in inputs {
        let inside = recordings_in(input, options);
        let is_folder_of_recordings = inside
            .as_ref()
            .is_ok_and(|inside| inside != std::slice::from_ref(input));
        if is_folder_of_recordings && options.task.is_none_or(|task| task.takes(0)) {
            let mask = options.mask.as_ref();
            let holds_masks = mask.is_some_and(|mask| is_same(input, mask));
            let beside = beside_recordings(input).unwrap_or_default();
            for path in beside.into_iter().filter(|_| !holds_masks) {
                if !is_same(&path, out) && !mask.is_some_and(|mask| is_same(&path, mask)) {
                    let what = "it is not a session and holds no video".to_owned();
                    report(
                        &path,
                        RecordingOutcome::LeftOut(ExtractError::Refused(what)),
                    );
                }
            }
        }
        if inside.is_ok()
            && !is_folder_of_recordings
            && options.task.is_none_or(|task| task.takes(0))
        {
            for path in hidden_recordings(input) {
                let what = "it is beside a video for which its folder stands: give it by itself";
                let error = ExtractError::Refused(what.to_owned());
                report(&path, RecordingOutcome::LeftOut(error));
            }
        }
        match inside {
            Ok(inside) => found.extend(inside),
            Err(error) => report(input, RecordingOutcome::from_result(Err(error.into()))),
        }
    }
    found
}

/// The recordings at a path of the local disk. Where masks are named by clips, a folder with one clip is that clip.
pub(super) fn recordings_in(
    path: &Path,
    options: &ExtractOptions,
) -> Result<Vec<PathBuf>, SessionError> {
    let has_folder_of_masks = options.mask.as_ref().is_some_and(|mask| mask.is_dir());
    if has_folder_of_masks {
        clips(path)
    } else {
        recordings(path)
    }
}

fn is_same(path: &Path, other: &Path) -> bool {
    let [path, other] = [path, other].map(|path| path.canonicalize().ok());
    path.is_some() && path == other
}

/// One extraction into one data set.
struct Run<'a> {
    folder: OutputFolder,
    catalog: DatasetIndex,
    /// What a task may take over.
    earlier: Option<Dataset>,
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
        summary: &mut ExtractSummary,
    ) -> Result<(), ExtractError> {
        // What a panic leaves behind of this recording lies under temporary names.
        let extracted = panic::catch_unwind(AssertUnwindSafe(|| self.extract_one(recording)));
        let outcome = RecordingOutcome::from_result(extracted.unwrap_or_else(|_| {
            let text = "a fault of the program, described above: please report it";
            Err(ExtractError::Refused(text.to_owned()))
        }));
        summary.count(&outcome);
        let name = recording_name(recording);
        self.observer.ended(recording, Some(&name), &outcome);
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
            return Err(if *other == id {
                ExtractError::Refused(format!(
                    "another recording of this call is also named {id}: extract them into different folders, or rename one"
                ))
            } else {
                name_alike(&id, other)
            });
        }
        self.names.insert(folded(&id), id);
        if let Some(earlier) = &self.earlier {
            self.catalog.adopt(earlier, job.id());
        }
        let dataset = self.catalog.dataset();
        if let Some(other) = job.alike(dataset) {
            return Err(name_alike(job.id(), other));
        }
        if options.resume
            && let Some(entry) = job.existing_entry(dataset, options)
            && self.storage.holds(dataset, folder.path(), job.id())
        {
            return Ok(RecordingOutcome::Skipped(Box::new(entry.clone())));
        }
        if !options.replace && job.would_replace_another(dataset) {
            return Err(ExtractError::Refused(format!(
                "{} holds a session {} from another video: extract into another folder, rename the input, or give --replace",
                folder.path().display(),
                job.id()
            )));
        }
        if options.task.is_some() {
            folder.clear_leftovers_of(job.id())?;
        }
        self.observer.started(job.id(), options.frames);
        let (entry, shards) = job.run(folder, options, &self.pool, self.observer)?;
        self.catalog.add(folder, entry.clone(), shards)?;
        Ok(RecordingOutcome::Extracted(Box::new(entry)))
    }
}

/// That two recordings have names that are one on some file systems.
fn name_alike(id: &str, other: &str) -> ExtractError {
    ExtractError::Refused(format!(
        "{id} and {other} differ only in case, which some file systems ignore: rename one, or extract it into another folder"
    ))
}
