//! A data set at a glance: what its description and its tables say, without its shards.

use std::collections::BTreeSet;
use std::path::Path;

use super::ShardError;
use super::dataset::{Dataset, SessionEntry};
use super::parquet_table::read_table;
use super::pieces::read_pieces;
use super::quality::{QualityVerdict, SessionQuality};
use super::record::FrameRecord;
use super::settings::ExtractionSettings;
use crate::causes::with_causes;
use crate::image_stats::SPEC_NET_GATE;

/// Places of the turn at which a session's saturation is kept.
const PLACES: usize = 90;

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
    /// How all sessions were extracted.
    pub settings: ExtractionSettings,
    /// The sessions whose tables could be read, sorted by id.
    pub sessions: Vec<SessionOverview>,
    /// What a reader must know of the whole: tables that cannot be read, pieces that are not merged.
    pub problems: Vec<String>,
}

/// A session at a glance.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct SessionOverview {
    /// Its entry in the description.
    pub entry: SessionEntry,
    /// The figures of its table, summed. For the verdict, see [`SessionOverview::verdict`].
    pub quality: SessionQuality,
    /// Its samples by saturated fraction.
    pub histogram: SaturationHistogram,
    /// The largest saturated fraction in each of up to 90 equal parts of the samples, by index.
    pub profile: Vec<f64>,
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
    /// Samples whose shift comes from the frames around.
    pub interpolated: u64,
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
                Ok(rows) if rows.len() == wanted => {
                    let records: Vec<FrameRecord> = rows.into_iter().map(|r| r.record).collect();
                    sessions.push(SessionOverview::of(entry, &records));
                }
                Ok(rows) => problems.push(format!(
                    "session {id} is left out: its table has {} rows for {wanted} samples",
                    rows.len()
                )),
                Err(error) => {
                    problems.push(format!("session {id} is left out: {}", with_causes(&error)));
                }
            }
        }
        Ok(Self {
            settings: dataset.settings,
            sessions,
            problems,
        })
    }

    /// Sums over all sessions.
    #[must_use]
    pub fn totals(&self) -> OverviewTotals {
        let mut totals = OverviewTotals::default();
        let mut objects = BTreeSet::new();
        for SessionOverview {
            entry,
            quality,
            histogram,
            ..
        } in &self.sessions
        {
            objects.insert(&entry.object);
            totals.samples += u64::from(entry.samples);
            totals.spec_net += u64::from(entry.spec_net);
            totals.duplicates += u64::from(entry.duplicates);
            totals.moved += u64::from(quality.moved);
            totals.unregistered += u64::from(quality.unregistered);
            totals.interpolated += u64::from(quality.interpolated);
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

    /// Number of sessions with this verdict; `None` counts those that were never judged.
    #[must_use]
    pub fn count(&self, verdict: Option<QualityVerdict>) -> usize {
        let verdicts = self.sessions.iter().map(SessionOverview::verdict);
        verdicts.filter(|&found| found == verdict).count()
    }
}

impl SessionOverview {
    /// The verdict in the description; `None` where an earlier version wrote none: the fields that it rests on
    /// are missing in such a table, too.
    #[must_use]
    pub fn verdict(&self) -> Option<QualityVerdict> {
        self.entry.quality.as_ref().map(|quality| quality.verdict)
    }

    /// Why the verdict is not good, one phrase each.
    #[must_use]
    pub fn reasons(&self) -> &[String] {
        let judged = self.entry.quality.as_ref();
        judged.map_or(&[], |quality| &quality.reasons)
    }

    fn of(entry: SessionEntry, records: &[FrameRecord]) -> Self {
        let mut histogram = SaturationHistogram::default();
        for record in records {
            let above = |bound: &&f64| record.saturated_fraction > **bound;
            let class = SATURATION_BOUNDS.iter().take_while(above).count();
            if let Some(samples) = histogram.get_mut(class) {
                *samples += 1;
            }
        }
        let parts = records.chunks(records.len().div_ceil(PLACES).max(1));
        let largest = |part: &[FrameRecord]| {
            part.iter()
                .map(|r| r.saturated_fraction)
                .fold(0.0, f64::max)
        };
        let judged = entry.quality.as_ref();
        Self {
            quality: SessionQuality {
                // The records do not tell it.
                mask_misfit: judged.and_then(|quality| quality.mask_misfit),
                ..SessionQuality::of(records, entry.lossy, entry.covered_deg)
            },
            histogram,
            profile: parts.map(largest).collect(),
            entry,
        }
    }
}

/// The description, or what the tasks' pieces describe together, and what is to say of that.
fn described(out: &Path) -> Result<(Dataset, Vec<String>), ShardError> {
    let none = match Dataset::read(out) {
        Err(none @ ShardError::NoDataset { .. }) => none,
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
    let (done, recordings) = (
        pieces
            .iter()
            .map(|piece| piece.outcomes.len())
            .sum::<usize>(),
        first.recordings.len(),
    );
    let problem = format!(
        "this is what {there} of {all} tasks have written so far, {done} of {recordings} recordings: when all are done, run relit-extract merge {}",
        out.display()
    );
    Ok((dataset, vec![problem]))
}
