//! A data set at a glance: what its description and its tables say, without its shards.

use std::collections::BTreeSet;
use std::path::Path;

use super::ShardError;
use super::dataset::{Dataset, SessionEntry};
use super::parquet_table::{TableRow, read_table};
use super::pieces::read_pieces;
use super::quality::QualityVerdict;
use crate::causes::with_causes;
use crate::image_stats::SPEC_NET_GATE;

/// The bounds of the classes of `saturated_fraction`: the first class holds exactly 0, each further one what
/// is above the bound before it and not above its own, the last one what is above the last bound.
pub const SATURATION_BOUNDS: [f64; 9] =
    [0.0, 0.001, 0.005, 0.01, 0.02, SPEC_NET_GATE, 0.1, 0.2, 0.5];

/// Numbers of samples by class of `saturated_fraction`: see [`SATURATION_BOUNDS`].
pub type SaturationHistogram = [u64; SATURATION_BOUNDS.len() + 1];

/// A data set at a glance.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Overview {
    /// The sessions whose tables could be read, sorted by id, each with its samples by saturated fraction.
    pub sessions: Vec<(SessionEntry, SaturationHistogram)>,
    /// What a reader must know of the whole: tables that cannot be read, pieces that are not merged.
    pub problems: Vec<String>,
}

/// Sums over the sessions of an [`Overview`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct OverviewTotals {
    /// Different objects.
    pub objects: usize,
    /// Samples.
    pub samples: u64,
    /// Samples with `spec_net`.
    pub spec_net: u64,
    /// Samples with `duplicate`.
    pub duplicates: u64,
    /// Samples with `shift_applied`.
    pub moved: u64,
    /// Samples whose frame could not be registered.
    pub unregistered: u64,
    /// Samples with `exposure_step`.
    pub exposure_steps: u64,
    /// Samples with `identical_to`.
    pub identical: u64,
    /// Samples with `blur`.
    pub blurred: u64,
    /// Sessions of which something is lost.
    pub lossy: usize,
    /// Warnings of all sessions.
    pub warnings: usize,
    /// Samples by saturated fraction.
    pub histogram: SaturationHistogram,
}

impl Overview {
    /// Reads the description and the tables of the data set in `out`, one table at a time. Where there is
    /// no description yet, the tasks' pieces are read.
    ///
    /// # Errors
    /// As [`Dataset::read`]. A table that cannot be read is a problem of the overview.
    pub fn read(out: &Path) -> Result<Self, ShardError> {
        let (dataset, mut problems) = described(out)?;
        let mut sessions = Vec::new();
        for entry in dataset.sessions {
            let (id, wanted) = (entry.id.clone(), entry.samples as usize);
            match read_table(out, &entry.table) {
                Ok(rows) if rows.len() == wanted => sessions.push((entry, histogram(&rows))),
                Ok(rows) => problems.push(format!(
                    "session {id} is left out: its table has {} rows for {wanted} samples",
                    rows.len()
                )),
                Err(error) => {
                    problems.push(format!("session {id} is left out: {}", with_causes(&error)));
                }
            }
        }
        Ok(Self { sessions, problems })
    }

    /// Sums over all sessions.
    #[must_use]
    pub fn totals(&self) -> OverviewTotals {
        let mut totals = OverviewTotals::default();
        let mut objects = BTreeSet::new();
        for (entry, histogram) in &self.sessions {
            let quality = &entry.quality;
            objects.insert(&entry.object);
            totals.samples += u64::from(entry.samples);
            totals.spec_net += u64::from(entry.spec_net);
            totals.duplicates += u64::from(entry.duplicates);
            totals.moved += u64::from(quality.moved);
            totals.unregistered += u64::from(quality.unregistered);
            totals.exposure_steps += u64::from(quality.exposure_steps);
            totals.identical += u64::from(quality.identical);
            totals.blurred += u64::from(quality.blurred);
            totals.lossy += usize::from(entry.lossy);
            totals.warnings += entry.warnings.len();
            for (sum, samples) in totals.histogram.iter_mut().zip(histogram) {
                *sum += samples;
            }
        }
        totals.objects = objects.len();
        totals
    }

    /// Number of sessions with this verdict.
    #[must_use]
    pub fn count(&self, verdict: QualityVerdict) -> usize {
        let verdicts = self.sessions.iter().map(|(entry, _)| entry.quality.verdict);
        verdicts.filter(|&found| found == verdict).count()
    }
}

/// The samples by saturated fraction.
fn histogram(rows: &[TableRow]) -> SaturationHistogram {
    let mut histogram = SaturationHistogram::default();
    for row in rows {
        let above = |bound: &&f64| row.record.saturated_fraction > **bound;
        let class = SATURATION_BOUNDS.iter().take_while(above).count();
        histogram[class] += 1;
    }
    histogram
}

/// The description, or what the tasks' pieces describe together, and what is to say of that.
fn described(out: &Path) -> Result<(Dataset, Vec<String>), ShardError> {
    let none = match Dataset::read(out) {
        Err(none @ ShardError::NoDataset(_)) => none,
        read => return Ok((read?, Vec::new())),
    };
    let pieces = read_pieces(out)?;
    let Some(first) = pieces.first() else {
        return Err(none);
    };
    let mut dataset = Dataset::new(first.dataset.settings.clone());
    for piece in &pieces {
        for entry in &piece.dataset.sessions {
            dataset.replace(entry.clone(), Vec::new());
        }
    }
    let (there, all) = (pieces.len(), first.task_count());
    let done: usize = pieces.iter().map(|piece| piece.outcomes.len()).sum();
    let recordings = first.recordings.len();
    let problem = format!(
        "this is what {there} of {all} tasks have written so far, {done} of {recordings} recordings: when all are done, run relit-extract merge {}",
        out.display()
    );
    Ok((dataset, vec![problem]))
}
