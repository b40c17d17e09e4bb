//! From a recording and its mask to a training shard: select -> decode -> crop -> align ->
//! measure -> scale -> encode -> write, as one streaming pipeline whose memory does not grow with the video.
//!
//! [`extract`] extracts any number of recordings into one data set; a failure does not stop the
//! others. The steps can be used alone: [`Selection`] chooses the frames of a turn, [`square_around`]
//! makes the crop, [`Aligner`] measures how far the object moved, [`Scaler`] scales without mixing object and background.
//!
//! This module knows the formats (`relit-data`) and videos (`relit-video`), and nothing of how masks
//! are made or of the rig. It prints nothing: progress goes to an [`Observer`].

mod align;
mod collected;
mod crop;
mod error;
mod job;
mod object;
mod observer;
mod options;
mod pipeline;
mod plan;
mod scale;
mod select;
mod steadiness;
mod timeline;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use rayon::{ThreadPool, ThreadPoolBuilder};

use relit_data::session::{self, recordings};
use relit_data::shard::{self, Dataset, ExtractionSettings, OutputFolder};

pub use align::{AlignBuffers, AlignSample, Aligner, Alignment, MIN_CONFIDENCE};
pub use crop::{bounding_box, cut, square_around};
pub use error::ExtractError;
pub use observer::{Observer, RecordingOutcome};
pub use options::{ExtractOptions, MAX_MARGIN, MAX_SHIFT, MAX_SIDE};
pub use scale::{APRON, Scaler};
pub use select::{Candidate, Selection, TimeGap, TurnSpan, runs_back_at, time_gaps};

/// The outcome of an extraction: numbers of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Tally {
    /// Recordings that were extracted.
    pub extracted: usize,
    /// Extracted or skipped recordings of which something is lost.
    pub lossy: usize,
    /// Recordings that were in the data set already.
    pub skipped: usize,
    /// Recordings that hold too little of a turn, and were left out.
    pub left_out: usize,
    /// Recordings that failed.
    pub failed: usize,
}

/// Extracts all recordings in `inputs` (session folders, folders of sessions, video files) into the
/// data set in the folder `out`, which is created if it does not exist.
///
/// # Errors
/// [`ExtractError`] if nothing can be extracted: an option is out of range, `out` holds a data set with other
/// settings, or it cannot be written. A failure with one input or recording is reported to `observer`
/// and counted.
pub fn extract(
    inputs: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
) -> Result<Tally, ExtractError> {
    options.check()?;
    if out.join(session::MANIFEST_FILE).exists() {
        return Err(ExtractError::IntoSession(out.to_owned()));
    }
    let folder = OutputFolder::lock(out)?;
    let dataset = open_dataset(out, options.settings())?;
    let pool = ThreadPoolBuilder::new()
        .num_threads(options.threads)
        .build()?;
    let mut run = Run {
        folder,
        dataset,
        options,
        pool,
        names: HashSet::new(),
        observer,
    };
    let mut tally = Tally::default();
    for input in inputs {
        match recordings(input) {
            Ok(found) => found
                .iter()
                .for_each(|recording| run.extract(recording, &mut tally)),
            Err(error) => run.end(input, Err(error.into()), &mut tally),
        }
    }
    Ok(tally)
}

/// One extraction into one data set.
struct Run<'a> {
    folder: OutputFolder,
    dataset: Dataset,
    options: &'a ExtractOptions,
    pool: ThreadPool,
    /// Names of the recordings so far.
    names: HashSet<String>,
    observer: &'a dyn Observer,
}

impl Run<'_> {
    fn extract(&mut self, recording: &Path, tally: &mut Tally) {
        let outcome = self.extract_one(recording);
        self.end(recording, outcome, tally);
    }

    fn end(
        &self,
        recording: &Path,
        outcome: Result<RecordingOutcome, ExtractError>,
        tally: &mut Tally,
    ) {
        let outcome = outcome.unwrap_or_else(|error| match error.leaves_out() {
            true => RecordingOutcome::LeftOut(error),
            false => RecordingOutcome::Failed(error),
        });
        match &outcome {
            RecordingOutcome::Extracted(entry) => {
                tally.extracted += 1;
                tally.lossy += usize::from(entry.lossy);
            }
            RecordingOutcome::Skipped(entry) => {
                tally.skipped += 1;
                tally.lossy += usize::from(entry.lossy);
            }
            RecordingOutcome::LeftOut(_) => tally.left_out += 1,
            RecordingOutcome::Failed(_) => tally.failed += 1,
        }
        self.observer.ended(recording, &outcome);
    }

    fn extract_one(&mut self, path: &Path) -> Result<RecordingOutcome, ExtractError> {
        let Self {
            folder, options, ..
        } = self;
        let job = job::Job::open(path, options)?;
        if !self.names.insert(job.id().to_owned()) {
            return Err(ExtractError::SameName(job.id().to_owned()));
        }
        if options.resume
            && let Some(entry) = job.existing_entry(&self.dataset, folder.path(), options)
        {
            return Ok(RecordingOutcome::Skipped(Box::new(entry.clone())));
        }
        if !options.replace && job.would_replace_another(&self.dataset) {
            let (out, id) = (folder.path().to_owned(), job.id().to_owned());
            return Err(ExtractError::NameTaken { out, id });
        }
        self.observer.started(path, options.frames);
        let (entry, shards) = job.run(folder, options, &self.pool, self.observer)?;
        // A description that could not be written does not replace the one in memory.
        let mut dataset = self.dataset.clone();
        dataset.replace(entry.clone(), shards);
        dataset.write(folder.path())?;
        self.dataset = dataset;
        Ok(RecordingOutcome::Extracted(Box::new(entry)))
    }
}

/// The data set in `out`, or a new one.
fn open_dataset(out: &Path, settings: ExtractionSettings) -> Result<Dataset, ExtractError> {
    let existing = match Dataset::read(out) {
        Ok(existing) => existing,
        Err(shard::ShardError::NoDataset { .. }) => return Ok(Dataset::new(settings)),
        Err(error) => return Err(error.into()),
    };
    if existing.settings == settings {
        return Ok(existing);
    }
    let values = [&existing.settings, &settings];
    let [old, new] = values.map(|s| serde_json::to_value(s).unwrap_or_default());
    let differ = old
        .as_object()
        .into_iter()
        .flatten()
        .filter_map(|(name, old)| {
            let new = &new[name];
            (old != new).then(|| format!("{name} {old} there, {new} now"))
        });
    Err(ExtractError::OtherSettings {
        out: out.to_owned(),
        differ: differ.collect::<Vec<_>>().join("; "),
    })
}
