//! Reading a data set back and naming what is wrong with it. Goes through damage: one problem
//! does not hide the next.

mod folder;
mod listing;
mod records;
mod sample;
mod tarball;

use std::fmt;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use super::dataset::{Dataset, SessionEntry, ShardEntry};
use super::record::FrameRecord;
use super::settings::{Layout, Settings};
use super::table::{Row, read_table};
use super::{Error, sample_key};
use crate::causes::with_causes;

/// What was read, and what is wrong with it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Verdict {
    /// Sessions that `dataset.json` lists.
    pub sessions: u64,
    /// Shards that were read.
    pub shards: u64,
    /// Samples of which every part was found.
    pub samples: u64,
    /// What is wrong; empty where the data set is whole.
    pub problems: Vec<Problem>,
}

/// Something that is wrong with a data set.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// The file, or the folder of images, relative to the data set.
    pub file: String,
    /// The key of the sample, `<session>/<kkkk>`, where it lies in one.
    pub sample: Option<String>,
    /// What is wrong.
    pub what: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.sample {
            Some(sample) => write!(f, "{}: sample {sample}: {}", self.file, self.what),
            None => write!(f, "{}: {}", self.file, self.what),
        }
    }
}

/// Reads the data set in the folder `out` back and checks all that can be checked: counts, names
/// and order; length and BLAKE3 of every file and every member; that images and masks decode,
/// have their sizes, and are 0 outside the mask; that masks are 0 and 255 and one a session; that
/// every record equals its row of the table and is consistent in itself; and, where images have
/// the source's own pixels, the figures measured on them.
///
/// `progress` is told samples done and samples in all, from time to time. Work is done on rayon's
/// threads, in batches of bounded size.
///
/// # Errors
/// Only where there is no data set to check: [`Error::NoDataset`], [`Error::Schema`],
/// [`Error::Description`], [`Error::UnsafePath`], [`Error::SessionName`], or [`Error::Io`] on
/// the folder. All else is a [`Problem`].
pub fn verify(out: &Path, progress: &(dyn Fn(u64, u64) + Sync)) -> Result<Verdict, Error> {
    let dataset = Dataset::read(out)?;
    let mut problems = listing::check(out, &dataset)?;
    let total = dataset
        .sessions
        .iter()
        .map(|session| u64::from(session.samples))
        .sum();
    let progress = Progress {
        done: AtomicU64::new(0),
        total,
        report: progress,
    };
    let (mut shards, mut samples) = (0, 0);
    for session in &dataset.sessions {
        let Some(shard) = listing::only_shard(&dataset, session) else {
            continue;
        };
        let mut check = SessionCheck::new(out, &dataset.settings, session, shard, &progress);
        shards += 1;
        samples += check.run();
        check
            .problems
            .sort_by(|a, b| (&a.file, &a.sample).cmp(&(&b.file, &b.sample)));
        problems.append(&mut check.problems);
    }
    let sessions = dataset.sessions.len() as u64;
    Ok(Verdict {
        sessions,
        shards,
        samples,
        problems,
    })
}

/// Counts samples for the caller.
struct Progress<'a> {
    done: AtomicU64,
    total: u64,
    report: &'a (dyn Fn(u64, u64) + Sync),
}

impl Progress<'_> {
    fn add(&self, samples: usize) {
        let before = self.done.fetch_add(samples as u64, Ordering::Relaxed);
        (self.report)((before + samples as u64).min(self.total), self.total);
    }
}

/// The check of one session.
struct SessionCheck<'a> {
    out: &'a Path,
    settings: &'a Settings,
    session: &'a SessionEntry,
    shard: &'a ShardEntry,
    progress: &'a Progress<'a>,
    /// The table, where it is whole: one row a sample, in index order.
    rows: Option<Vec<Row>>,
    problems: Vec<Problem>,
}

impl<'a> SessionCheck<'a> {
    fn new(
        out: &'a Path,
        settings: &'a Settings,
        session: &'a SessionEntry,
        shard: &'a ShardEntry,
        progress: &'a Progress<'a>,
    ) -> Self {
        let problems = Vec::new();
        Self {
            out,
            settings,
            session,
            shard,
            progress,
            rows: None,
            problems,
        }
    }

    /// Checks table and shard; the number of samples that were found whole.
    fn run(&mut self) -> u64 {
        self.rows = self.read_table();
        let found = match self.settings.layout {
            Layout::Webdataset => tarball::check(self),
            Layout::Relit => folder::check(self),
        };
        // Where the table cannot be trusted, the records in the shard stand in for it.
        let from_table = self.rows.is_some();
        let file = if from_table {
            &self.session.table.file
        } else {
            &self.shard.file
        };
        let records: Vec<Option<&FrameRecord>> = match &self.rows {
            Some(rows) => rows.iter().map(|row| Some(&row.record)).collect(),
            None => found.records.iter().map(Option::as_ref).collect(),
        };
        let wrong = records::check(self.settings, self.session, &records);
        let problems = wrong
            .into_iter()
            .map(|(index, what)| self.at(file, index, what));
        let problems: Vec<Problem> = problems.collect();
        self.problems.extend(problems);
        let expected = u64::from(self.session.samples);
        // Whatever the reason, a sample less is a problem.
        if found.samples != expected && self.problems.is_empty() {
            self.note(
                None,
                format!("{} of {expected} samples are whole", found.samples),
            );
        }
        found.samples
    }

    fn read_table(&mut self) -> Option<Vec<Row>> {
        let file = &self.session.table.file;
        let rows = match read_table(self.out, &self.session.table) {
            Ok(rows) => rows,
            Err(error) => {
                self.problems.push(self.at(file, None, with_causes(&error)));
                return None;
            }
        };
        if rows.len() != self.session.samples as usize {
            let what = format!(
                "it has {} rows for {} samples",
                rows.len(),
                self.session.samples
            );
            self.problems.push(self.at(file, None, what));
            return None;
        }
        if let Some((row, index)) = (0..).zip(&rows).find(|(k, row)| *k != row.record.index) {
            let what = format!("row {row} is of index {}", index.record.index);
            self.problems.push(self.at(file, Some(row), what));
            return None;
        }
        Some(rows)
    }

    fn row(&self, index: u32) -> Option<&Row> {
        self.rows.as_ref()?.get(index as usize)
    }

    /// A problem with a file of this session.
    fn at(&self, file: &str, index: Option<u32>, what: String) -> Problem {
        let sample = index.map(|index| sample_key(&self.session.id, index));
        Problem {
            file: file.to_owned(),
            sample,
            what,
        }
    }

    /// Notes a problem with the shard.
    fn note(&mut self, index: Option<u32>, what: String) {
        let problem = self.at(&self.shard.file, index, what);
        self.problems.push(problem);
    }
}

/// What a shard was found to hold.
struct Found {
    /// Samples of which every part was there.
    samples: u64,
    /// The records that could be read, by index; empty in a layout without records.
    records: Vec<Option<FrameRecord>>,
}
