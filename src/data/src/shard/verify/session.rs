//! The state that the checks of one session share.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use super::VerifyProblem;
use crate::causes::with_causes;
use crate::shard::dataset::{SessionEntry, ShardEntry};
use crate::shard::names::sample_key;
use crate::shard::parquet_table::{TableRow, read_table};
use crate::shard::record::FrameRecord;
use crate::shard::settings::ExtractionSettings;

/// Counts verified samples and reports them to the caller.
pub(super) struct Progress<'a> {
    done: AtomicU64,
    total: u64,
    report: &'a (dyn Fn(u64, u64) + Sync),
}

impl<'a> Progress<'a> {
    pub(super) fn new(total: u64, report: &'a (dyn Fn(u64, u64) + Sync)) -> Self {
        let done = AtomicU64::new(0);
        Self {
            done,
            total,
            report,
        }
    }

    pub(super) fn add(&self, samples: usize) {
        let before = self.done.fetch_add(samples as u64, Ordering::Relaxed);
        (self.report)((before + samples as u64).min(self.total), self.total);
    }
}

/// The check of one session.
pub(super) struct SessionCheck<'a> {
    pub(super) out: &'a Path,
    pub(super) settings: &'a ExtractionSettings,
    pub(super) session: &'a SessionEntry,
    pub(super) shard: &'a ShardEntry,
    pub(super) progress: &'a Progress<'a>,
    /// The table, if it is intact: one row per sample, in index order.
    pub(super) rows: Option<Vec<TableRow>>,
    pub(super) problems: Vec<VerifyProblem>,
}

/// What was found in a shard.
pub(super) struct ShardContents {
    /// Samples with all their parts.
    pub(super) samples: u64,
    /// The records that could be read, by index; empty in a layout without records.
    pub(super) records: Vec<Option<FrameRecord>>,
}

impl<'a> SessionCheck<'a> {
    /// Starts the check and reads the session's table.
    pub(super) fn new(
        out: &'a Path,
        settings: &'a ExtractionSettings,
        session: &'a SessionEntry,
        shard: &'a ShardEntry,
        progress: &'a Progress<'a>,
    ) -> Self {
        let mut check = Self {
            out,
            settings,
            session,
            shard,
            progress,
            rows: None,
            problems: Vec::new(),
        };
        check.rows = check.read_table();
        check
    }

    fn read_table(&mut self) -> Option<Vec<TableRow>> {
        let file = &self.session.table.file;
        let rows = match read_table(self.out, &self.session.table) {
            Ok(rows) => rows,
            Err(error) => {
                self.note_in(file, None, with_causes(&error));
                return None;
            }
        };
        if rows.len() != self.session.samples as usize {
            let samples = self.session.samples;
            let what = format!("it has {} rows for {samples} samples", rows.len());
            self.note_in(file, None, what);
            return None;
        }
        if let Some((row, index)) = (0..).zip(&rows).find(|(k, row)| *k != row.record.index) {
            let what = format!("row {row} has index {}", index.record.index);
            self.note_in(file, Some(row), what);
            return None;
        }
        Some(rows)
    }

    /// The table's row of a sample.
    pub(super) fn row(&self, index: u32) -> Option<&TableRow> {
        self.rows.as_ref()?.get(index as usize)
    }

    /// Adds a problem with the shard, and with the sample `index` if there is one.
    pub(super) fn note(&mut self, index: Option<u32>, what: String) {
        self.note_in(&self.shard.file, index, what);
    }

    /// Adds a problem with another file of this session.
    pub(super) fn note_in(&mut self, file: &str, index: Option<u32>, what: String) {
        let sample = index.map(|index| sample_key(&self.session.id, index));
        let file = file.to_owned();
        self.problems.push(VerifyProblem {
            session: Some(self.session.id.clone()),
            file,
            sample,
            what,
        });
    }
}
