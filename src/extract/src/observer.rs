//! What is reported while recordings are extracted.

use std::path::Path;

use relit_data::shard::SessionEntry;

use super::ExtractError;

/// Receives the progress of an extraction, from several threads. `()` ignores it.
pub trait Observer: Sync {
    /// So many recordings will be worked on.
    fn planned(&self, recordings: usize);
    /// The extraction of a session starts; it will have `samples` samples.
    fn started(&self, session: &str, samples: u32);
    /// One more sample was written.
    fn advanced(&self);
    /// Work on a recording ended, whose session has this name; or the input is none.
    fn ended(&self, input: &Path, session: Option<&str>, outcome: &RecordingOutcome);
}

impl Observer for () {
    fn planned(&self, _recordings: usize) {}
    fn started(&self, _session: &str, _samples: u32) {}
    fn advanced(&self) {}
    fn ended(&self, _input: &Path, _session: Option<&str>, _outcome: &RecordingOutcome) {}
}

/// The outcome of one recording.
#[derive(Debug)]
pub enum RecordingOutcome {
    /// It is in the data set; the entry's warnings say what to know about it.
    Extracted(Box<SessionEntry>),
    /// It was in the data set already, intact and with the same settings, video, index and mask.
    Skipped(Box<SessionEntry>),
    /// It holds too little of a turn, and is not in the data set.
    LeftOut(ExtractError),
    /// It is not in the data set.
    Failed(ExtractError),
}

impl RecordingOutcome {
    /// The outcome; some errors are not failures.
    pub(super) fn from_result(result: Result<Self, ExtractError>) -> Self {
        result.unwrap_or_else(|error| {
            if error.skips_recording() {
                Self::LeftOut(error)
            } else {
                Self::Failed(error)
            }
        })
    }
}

/// The outcome of an extraction: numbers of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ExtractSummary {
    /// Recordings that were extracted.
    pub extracted: usize,
    /// Extracted or skipped recordings with losses.
    pub lossy: usize,
    /// Extracted or skipped recordings whose mask does not fit.
    pub misfits: usize,
    /// Extracted or skipped recordings whose verdict is broken.
    pub broken: usize,
    /// Extracted or skipped recordings to which any of these three applies.
    pub flawed: usize,
    /// Recordings that were in the data set already.
    pub skipped: usize,
    /// Recordings that hold too little of a turn, and were left out.
    pub left_out: usize,
    /// Recordings that failed.
    pub failed: usize,
}

impl ExtractSummary {
    /// Counts a recording.
    pub(super) fn count(&mut self, outcome: &RecordingOutcome) {
        match outcome {
            RecordingOutcome::Extracted(entry) => {
                self.extracted += 1;
                self.count_flaws(entry);
            }
            RecordingOutcome::Skipped(entry) => {
                self.skipped += 1;
                self.count_flaws(entry);
            }
            RecordingOutcome::LeftOut(_) => self.left_out += 1,
            RecordingOutcome::Failed(_) => self.failed += 1,
        }
    }

    fn count_flaws(&mut self, entry: &SessionEntry) {
        self.lossy += usize::from(entry.lossy);
        self.misfits += usize::from(entry.has_misfit());
        self.broken += usize::from(entry.is_broken());
        self.flawed += usize::from(entry.is_flawed());
    }
}
