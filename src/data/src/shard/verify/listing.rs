//! Checks that `dataset.json` is consistent and that the folder holds no files that it does not
//! list.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::VerifyProblem;
use crate::causes::with_causes;
use crate::file_names::folded;
use crate::shard::dataset::{Dataset, SessionEntry, ShardEntry};
use crate::shard::{MAX_SAMPLES, ShardError, names, output};

const UNLISTED: &str = "dataset.json does not list it";

/// The problems with the list of sessions and shards, with reports, and with unlisted files.
pub(super) fn check(out: &Path, dataset: &Dataset) -> Result<Vec<VerifyProblem>, ShardError> {
    let mut problems = entries(dataset);
    for session in &dataset.sessions {
        if let Some(report) = &session.report
            && let Err(error) = report.check(out)
        {
            problems.push(VerifyProblem {
                session: Some(session.id.clone()),
                ..about(&report.file, with_causes(&error))
            });
        }
    }
    problems.extend(unlisted(out, dataset)?);
    Ok(problems)
}

/// The shard of a session, if it can be checked: there is exactly one, and a valid number of
/// samples.
pub(super) fn only_shard<'a>(
    dataset: &'a Dataset,
    session: &'a SessionEntry,
) -> Option<&'a ShardEntry> {
    let mut shards = dataset.shards_of(&session.id);
    let first = shards.next()?;
    (shards.next().is_none() && (1..=MAX_SAMPLES).contains(&session.samples)).then_some(first)
}

fn about(file: &str, what: String) -> VerifyProblem {
    VerifyProblem {
        session: None,
        file: file.to_owned(),
        sample: None,
        what,
    }
}

fn entries(dataset: &Dataset) -> Vec<VerifyProblem> {
    let mut problems = Vec::new();
    let mut wrong = |what: String| problems.push(about(Dataset::FILE, what));
    for (name, count) in counted(dataset.sessions.iter().map(|session| session.id.as_str())) {
        if count > 1 {
            wrong(format!("session {name:?} is listed {count} times"));
        }
    }
    let mut folded_names = HashMap::new();
    for session in &dataset.sessions {
        let id = session.id.as_str();
        let other = *folded_names.entry(folded(id)).or_insert(id);
        if other != id {
            wrong(format!(
                "the sessions {other:?} and {id:?} differ only in case, which some file systems ignore"
            ));
        }
    }
    for (file, count) in counted(dataset.files()) {
        if count > 1 {
            wrong(format!("the file {file:?} is listed {count} times"));
        }
    }
    for session in &dataset.sessions {
        session_entry(dataset, session)
            .into_iter()
            .for_each(&mut wrong);
    }
    for shard in &dataset.shards {
        if dataset.session(&shard.session).is_none() {
            wrong(format!(
                "shard {:?} belongs to the unknown session {:?}",
                shard.file, shard.session
            ));
        }
    }
    problems
}

fn session_entry(dataset: &Dataset, session: &SessionEntry) -> Vec<String> {
    let SessionEntry { id, samples, .. } = session;
    let mut problems = Vec::new();
    let count = dataset.shards_of(id).count();
    if count != 1 {
        problems.push(format!("session {id:?} has {count} shards instead of 1"));
    }
    let most = dataset.settings.frames;
    let is_right = match session.covered_deg {
        Some(degrees) => (1..=most).contains(samples) && (0.0..360.0).contains(&degrees),
        None => *samples == most,
    };
    if !is_right || !(1..=MAX_SAMPLES).contains(samples) {
        let frames = dataset.settings.frames;
        problems.push(format!(
            "session {id:?} has {samples} samples, the settings say {frames}"
        ));
    }
    let expected = dataset.settings.layout.shard_file(id);
    for shard in dataset.shards_of(id) {
        if shard.samples != *samples {
            let of_shard = shard.samples;
            problems.push(format!(
                "session {id:?} has {samples} samples, its shard {of_shard}"
            ));
        }
        if shard.file != expected {
            problems.push(format!(
                "session {id:?} has the shard {:?}, not {expected:?}",
                shard.file
            ));
        }
    }
    problems
}

/// Each name and how often it occurs, in order of first occurrence.
fn counted<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, u32)> {
    let mut positions = HashMap::new();
    let mut counts: Vec<(&str, u32)> = Vec::new();
    for name in names {
        let position = *positions.entry(name).or_insert(counts.len());
        match counts.get_mut(position) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    counts
}

/// Shards, tables, images and temporary files in the folder that have no entry.
fn unlisted(out: &Path, dataset: &Dataset) -> Result<Vec<VerifyProblem>, ShardError> {
    let known: HashSet<&str> = dataset.files().collect();
    let mut problems = Vec::new();
    for name in output::names_in(out)? {
        if names::is_leftover(&name) {
            let what = "it was left behind by an interrupted writer";
            problems.push(about(&name, what.to_owned()));
        } else if is_data(&name) && !known.contains(name.as_str()) {
            problems.push(about(&name, UNLISTED.to_owned()));
        }
    }
    for folder in [names::IMAGES, names::MASKS, names::MEANS] {
        for name in output::names_in(&out.join(folder))? {
            let path = format!("{folder}/{name}");
            if !known.contains(path.as_str()) {
                problems.push(about(&path, UNLISTED.to_owned()));
            }
        }
    }
    Ok(problems)
}

fn is_data(name: &str) -> bool {
    [".tar", ".parquet", ".png"]
        .iter()
        .any(|end| name.ends_with(end))
}
