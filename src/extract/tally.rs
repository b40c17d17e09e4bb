//! What became of all recordings of an extraction, counted.

use relit_data::shard::SessionEntry;

use super::RecordingOutcome;

/// The outcome of an extraction: numbers of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct Tally {
    /// Recordings that were extracted.
    pub extracted: usize,
    /// Extracted or skipped recordings of which something is lost.
    pub lossy: usize,
    /// Extracted or skipped recordings whose mask does not fit.
    pub misfits: usize,
    /// Recordings that were in the data set already.
    pub skipped: usize,
    /// Recordings that hold too little of a turn, and were left out.
    pub left_out: usize,
    /// Recordings that failed.
    pub failed: usize,
}

impl Tally {
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
    }
}
