//! Reading a data set back and reporting what is wrong with it. Damage does not end the check: one
//! problem does not hide the next.

mod folder;
mod listing;
mod records;
mod sample;
mod session;
mod tar;

use std::fmt;
use std::path::Path;

use super::ShardError;
use super::dataset::Dataset;
use super::output;
use super::record::FrameRecord;
use super::settings::Layout;
use session::{Progress, SessionCheck, ShardContents};

/// The result of a verification.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerifyReport {
    /// Sessions that `dataset.json` lists.
    pub sessions: u64,
    /// Shards that were read.
    pub shards: u64,
    /// Samples with all their parts.
    pub samples: u64,
    /// What is wrong; empty if the data set is intact.
    pub problems: Vec<VerifyProblem>,
}

/// Something that is wrong with a data set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct VerifyProblem {
    /// The session, if it is known.
    pub session: Option<String>,
    /// The file, or the folder of images, relative to the data set.
    pub file: String,
    /// The key of the sample, `<session>/<kkkk>`, if the problem concerns one.
    pub sample: Option<String>,
    /// What is wrong.
    pub what: String,
}

impl fmt::Display for VerifyProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.sample {
            Some(sample) => write!(f, "{}: sample {sample}: {}", self.file, self.what),
            None => write!(f, "{}: {}", self.file, self.what),
        }
    }
}

/// Reads the data set in the folder `out` back and checks everything that can be checked: counts,
/// names and order; length and BLAKE3 of every file and every member; that images and masks decode,
/// have the right sizes, and images are 0 outside the mask; that masks hold 0 and 255 only and a
/// session has one; that every record equals its row of the table and is consistent in itself; and,
/// if images have the source's own pixels, the figures measured on them.
///
/// `progress` is called from time to time with the samples done and the total. The work runs on
/// rayon's threads, in batches of bounded size.
///
/// # Errors
/// Only without a data set to check: [`ShardError::NoDataset`], [`ShardError::Description`],
/// [`ShardError::Refused`], [`ShardError::Locked`] while it is being written, or [`ShardError::Io`] on the folder. Everything else is a
/// [`VerifyProblem`].
pub fn verify(
    out: &Path,
    progress: &(dyn Fn(u64, u64) + Sync),
) -> Result<VerifyReport, ShardError> {
    let _lock = output::lock_for_reading(out)?;
    let dataset = Dataset::read(out)?;
    let mut problems = listing::check(out, &dataset)?;
    let samples_of = |session: &super::SessionEntry| u64::from(session.samples);
    let total = dataset.sessions.iter().map(samples_of).sum();
    let progress = Progress::new(total, progress);
    let (mut shards, mut samples) = (0, 0);
    for session in &dataset.sessions {
        let Some(shard) = listing::only_shard(&dataset, session) else {
            continue;
        };
        let mut check = SessionCheck::new(out, &dataset.settings, session, shard, &progress);
        shards += 1;
        samples += check_session(&mut check);
        check
            .problems
            .sort_by(|a, b| (&a.file, &a.sample).cmp(&(&b.file, &b.sample)));
        problems.append(&mut check.problems);
    }
    let sessions = dataset.sessions.len() as u64;
    Ok(VerifyReport {
        sessions,
        shards,
        samples,
        problems,
    })
}

/// Checks the shard and the records of a session; returns the number of complete samples.
fn check_session(check: &mut SessionCheck<'_>) -> u64 {
    let found = match check.settings.layout {
        Layout::Webdataset => tar::check(check),
        Layout::Paper => folder::check(check),
    };
    check_records(check, &found);
    let expected = u64::from(check.session.samples);
    // A missing sample is a problem, whatever the reason.
    if found.samples != expected && check.problems.is_empty() {
        let what = format!("{} of {expected} samples are complete", found.samples);
        check.note(None, what);
    }
    found.samples
}

/// Checks the records of the table or, if the table is damaged, those in the shard.
fn check_records(check: &mut SessionCheck<'_>, found: &ShardContents) {
    let (file, records): (_, Vec<Option<&FrameRecord>>) = match &check.rows {
        Some(rows) => {
            let records = rows.iter().map(|row| Some(&row.record));
            (&check.session.table.file, records.collect())
        }
        None => {
            let records = found.records.iter().map(Option::as_ref);
            (&check.shard.file, records.collect())
        }
    };
    for (index, what) in records::check(check.settings, check.session, &records) {
        check.note_in(file, index, what);
    }
}
