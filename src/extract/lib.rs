//! From a recording and its mask to a training shard: select -> decode -> crop -> align ->
//! measure -> scale -> encode -> write, as one streaming pipeline whose memory does not grow with the video.
//!
//! [`extract`] extracts any number of recordings into one data set; a failure does not stop the
//! others. The steps can be used alone: [`Selection`] chooses the frames of a turn, [`square_around`]
//! makes the crop, [`Aligner`] measures how far the object moved, [`Scaler`] scales without mixing object and background.
//!
//! The crate knows the formats (`relit-data`) and videos (`relit-video`), and looks at a mask before it is
//! used (`relit-grabcut`); it knows nothing of how masks are made or of the rig. It prints nothing: progress
//! goes to an [`Observer`]. The program `relit-extract` around it is in `cli/`.
//!
//! # Extract a recording into a data set
//!
//! ```
//! use std::path::Path;
//!
//! use relit_data::shard::{Dataset, ImageSize, verify};
//! use relit_extract::{ExtractOptions, extract};
//!
//! let recording = Path::new("../../fixtures/20261120T102000Z-bust-short");
//! let out = tempfile::tempdir()?;
//! let options = ExtractOptions {
//!     frames: 24,
//!     size: ImageSize::Pixels(64),
//!     mask: Some(recording.join("mask_gt.png")),
//!     ..ExtractOptions::default()
//! };
//! // The observer `()` ignores the progress.
//! let tally = extract(&[recording.to_owned()], out.path(), &options, &())?;
//! assert_eq!((tally.extracted, tally.failed), (1, 0));
//!
//! let dataset = Dataset::read(out.path())?;
//! assert_eq!(dataset.sessions[0].samples, 24);
//! assert!(verify(out.path(), &|_done, _total| {})?.problems.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod align;
mod blur;
mod catalog;
mod collected;
mod crop;
mod depot;
mod error;
mod job;
mod mask_doubts;
mod object;
pub mod objects;
mod observer;
mod options;
mod pipeline;
mod plan;
mod quality;
mod scale;
mod select;
mod steadiness;
mod timeline;
mod view;

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use rayon::{ThreadPool, ThreadPoolBuilder};

use relit_data::session::{self, recordings};
use relit_data::shard::OutputFolder;

use catalog::Catalog;
use depot::{Depot, OnDisk};

pub use align::{AlignBuffers, AlignSample, Aligner, Alignment};
pub use crop::{bounding_box, cut, square_around};
pub use error::ExtractError;
pub use mask_doubts::mask_doubts;
pub use observer::{Observer, RecordingOutcome};
pub use options::{ExtractOptions, MAX_MARGIN, MAX_SHIFT, MAX_SIDE};
pub use scale::{APRON, ScaleBuffers, Scaler};
pub use select::{Candidate, Selection, TimeGap, TurnSpan, runs_back_at, time_gaps};
pub use view::View;

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
/// data set in the folder `out`, which is created if it does not exist. With the feature `object-store`, both may
/// be URLs: see [`objects`].
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
    if inputs.iter().any(|input| objects::is_url(input)) || objects::is_url(out) {
        return objects::extract(inputs, out, options, observer);
    }
    let mut tally = Tally::default();
    let found = find(inputs, observer, &mut tally);
    extract_recordings(&found, out, options, observer, &OnDisk, tally)
}

/// Extracts the recordings `found` into the folder `out`, and adds the outcomes to `tally`.
fn extract_recordings(
    found: &[PathBuf],
    out: &Path,
    options: &ExtractOptions,
    observer: &dyn Observer,
    depot: &dyn Depot,
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
        names: HashSet::new(),
        observer,
        depot,
    };
    for (position, recording) in found.iter().enumerate() {
        if options.task.is_none_or(|task| task.takes(position)) {
            run.extract(position, recording, &mut tally)?;
        }
    }
    Ok(tally)
}

/// All recordings in the inputs, in the order in which tasks share them; inputs without any are reported.
fn find(inputs: &[PathBuf], observer: &dyn Observer, tally: &mut Tally) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for input in inputs {
        match recordings(input) {
            Ok(inside) => found.extend(inside),
            Err(error) => {
                let outcome = RecordingOutcome::of(Err(error.into()));
                tally.count(&outcome);
                observer.ended(input, &outcome);
            }
        }
    }
    found
}

impl Tally {
    fn count(&mut self, outcome: &RecordingOutcome) {
        match outcome {
            RecordingOutcome::Extracted(entry) => {
                self.extracted += 1;
                self.lossy += usize::from(entry.lossy);
            }
            RecordingOutcome::Skipped(entry) => {
                self.skipped += 1;
                self.lossy += usize::from(entry.lossy);
            }
            RecordingOutcome::LeftOut(_) => self.left_out += 1,
            RecordingOutcome::Failed(_) => self.failed += 1,
        }
    }
}

/// One extraction into one data set.
struct Run<'a> {
    folder: OutputFolder,
    catalog: Catalog,
    options: &'a ExtractOptions,
    pool: ThreadPool,
    /// Names of the recordings so far.
    names: HashSet<String>,
    observer: &'a dyn Observer,
    depot: &'a dyn Depot,
}

impl Run<'_> {
    /// Extracts a recording and notes the outcome; an error if a task's outcome cannot be noted.
    fn extract(
        &mut self,
        position: usize,
        recording: &Path,
        tally: &mut Tally,
    ) -> Result<(), ExtractError> {
        let outcome = RecordingOutcome::of(self.extract_one(recording));
        tally.count(&outcome);
        self.observer.ended(recording, &outcome);
        self.catalog.note(&self.folder, position, &outcome)?;
        let extracted = match &outcome {
            RecordingOutcome::Extracted(entry) => Some(entry.id.as_str()),
            _ => None,
        };
        self.depot
            .ended(recording, self.catalog.dataset(), extracted)
    }

    fn extract_one(&mut self, path: &Path) -> Result<RecordingOutcome, ExtractError> {
        let Self {
            folder, options, ..
        } = self;
        let local = self.depot.fetch(path)?;
        let job = job::Job::open(&local, options)?;
        if !self.names.insert(job.id().to_owned()) {
            return Err(ExtractError::SameName(job.id().to_owned()));
        }
        let dataset = self.catalog.dataset();
        if options.resume
            && let Some(entry) = job.existing_entry(dataset, options)
            && self.depot.holds(dataset, folder.path(), job.id())
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
