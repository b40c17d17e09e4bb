//! Checks that records are consistent, each in itself and with one another. Knows no files.

use std::collections::HashSet;

use crate::image_stats::fraction;
use crate::shard::dataset::SessionEntry;
use crate::shard::quality::SessionQuality;
use crate::shard::record::FrameRecord;
use crate::shard::settings::{ExtractionSettings, ImageSize};
use crate::spec_net_gate;

/// The problems with the records of a session, given by index (`None` if one could not be read).
/// A problem with a sample has its index, one with the session has none.
pub(super) fn check(
    settings: &ExtractionSettings,
    session: &SessionEntry,
    records: &[Option<&FrameRecord>],
) -> Vec<(Option<u32>, String)> {
    let mut problems = Vec::new();
    for (index, record) in (0..).zip(records) {
        let Some(record) = record else { continue };
        let wrong = record_problems(settings, session, index, record);
        problems.extend(wrong.into_iter().map(|what| (Some(index), what)));
    }
    let flags = duplicate_flags(records).into_iter();
    problems.extend(flags.map(|(index, what)| (Some(index), what)));
    let known: Vec<FrameRecord> = records.iter().copied().flatten().cloned().collect();
    if known.len() == records.len() && !known.is_empty() {
        let wrong = totals(session, &known).into_iter();
        problems.extend(wrong.map(|what| (None, what)));
    }
    problems
}

/// Wrong flags `duplicate`: of the samples of one source frame exactly one must not be flagged.
fn duplicate_flags(records: &[Option<&FrameRecord>]) -> Vec<(u32, String)> {
    let known = || records.iter().flatten();
    let mut originals = HashSet::new();
    let mut wrong = Vec::new();
    for record in known().filter(|record| !record.duplicate) {
        if !originals.insert(record.source_frame) {
            let what = format!(
                "duplicate is false, but it is also false in another sample of source frame {}",
                record.source_frame
            );
            wrong.push((record.index, what));
        }
    }
    if records.iter().any(Option::is_none) {
        // The sample that is not flagged may be one that could not be read.
        return wrong;
    }
    for record in known().filter(|record| record.duplicate) {
        if !originals.contains(&record.source_frame) {
            let what = format!(
                "duplicate is true, but it is true in every sample of source frame {}",
                record.source_frame
            );
            wrong.push((record.index, what));
        }
    }
    wrong
}

/// The problems with one record in itself.
fn record_problems(
    settings: &ExtractionSettings,
    session: &SessionEntry,
    index: u32,
    r: &FrameRecord,
) -> Vec<String> {
    let expected_fraction = fraction(r.saturated_px, r.mask_px);
    let size = match settings.size {
        ImageSize::Native(_) => [r.crop.w, r.crop.h],
        ImageSize::Pixels(side) => [side, side],
    };
    let checks = [
        (
            r.session == session.id,
            format!("session is {:?}, not {:?}", r.session, session.id),
        ),
        (
            r.object == session.object,
            format!("object is {:?}, not {:?}", r.object, session.object),
        ),
        (
            r.index == index,
            format!("index is {}, not {index}", r.index),
        ),
        (
            r.size == size,
            format!("size is {:?}, not {size:?} as the settings say", r.size),
        ),
        (
            r.saturated_px <= r.mask_px && r.saturated_any_px <= r.mask_px,
            format!(
                "more pixels are saturated than the {} under the mask",
                r.mask_px
            ),
        ),
        (
            // Of an object that moved beyond the frame, less than the mask was seen.
            r.mask_px == session.mask.px || r.shift_applied && r.mask_px < session.mask.px,
            format!(
                "mask_px is {}, dataset.json says {} pixels under the mask",
                r.mask_px, session.mask.px
            ),
        ),
        (
            r.saturated_any_px >= r.saturated_px,
            format!(
                "saturated_any_px is {}, below saturated_px, {}",
                r.saturated_any_px, r.saturated_px
            ),
        ),
        (
            r.saturated_fraction == expected_fraction,
            format!(
                "saturated_fraction is {}, not {expected_fraction}",
                r.saturated_fraction
            ),
        ),
        (
            r.spec_net == spec_net_gate::opens(r.saturated_fraction, settings.gate),
            format!(
                "spec_net is {} at a fraction of {} and a gate of {}",
                r.spec_net, r.saturated_fraction, settings.gate
            ),
        ),
    ];
    checks
        .into_iter()
        .filter(|(right, _)| !right)
        .map(|(_, what)| what)
        .collect()
}

/// The problems with the counts in the session's entry.
fn totals(session: &SessionEntry, records: &[FrameRecord]) -> Vec<String> {
    let count = |flag: fn(&FrameRecord) -> bool| records.iter().filter(|r| flag(r)).count() as u32;
    let counts = [
        ("duplicates", session.duplicates, count(|r| r.duplicate)),
        ("spec_net", session.spec_net, count(|r| r.spec_net)),
    ];
    let wrong = counts
        .into_iter()
        .filter(|(_, listed, found)| listed != found);
    let mut problems: Vec<String> = wrong
        .map(|(what, listed, found)| {
            format!("dataset.json says {listed} samples have {what}, the records say {found}")
        })
        .collect();
    // The records do not tell whether the mask fits, nor how that lowers the verdict.
    let listed = &session.quality;
    let found = SessionQuality {
        verdict: listed.verdict,
        reasons: listed.reasons.clone(),
        mask_misfit: listed.mask_misfit,
        ..SessionQuality::from_records(records, session.lossy, session.covered_deg)
    };
    if found != *listed {
        problems.push("the figures under quality are not those of the records".to_owned());
    }
    problems
}

/// The fields in which two records differ.
pub(super) fn difference(a: &FrameRecord, b: &FrameRecord) -> Vec<String> {
    let fields = |record| match serde_json::to_value(record) {
        Ok(serde_json::Value::Object(fields)) => fields,
        _ => serde_json::Map::new(),
    };
    let (a, b) = (fields(a), fields(b));
    a.iter()
        .filter(|(name, value)| b.get(*name) != Some(value))
        .map(|(n, _)| n.clone())
        .collect()
}
