//! Whether `dataset.json` is consistent, and whether the folder holds files that it does not
//! know.

use std::collections::{HashMap, HashSet};
use std::path::Path;

use super::Problem;
use crate::causes::with_causes;
use crate::shard::dataset::{Dataset, SessionEntry, ShardEntry};
use crate::shard::vouch::check_file;
use crate::shard::{Error, MAX_SAMPLES, names, output};

/// What is wrong with the list of sessions and shards, with pages, and with stray files.
pub(super) fn check(out: &Path, dataset: &Dataset) -> Result<Vec<Problem>, Error> {
    let mut problems = entries(dataset);
    for report in dataset
        .sessions
        .iter()
        .filter_map(|session| session.report.as_ref())
    {
        if let Err(error) = check_file(out, report) {
            problems.push(about(&report.file, with_causes(&error)));
        }
    }
    problems.extend(strays(out, dataset)?);
    Ok(problems)
}

/// The shard of a session, where it can be checked: there is one, and no more samples than a
/// session may have.
pub(super) fn only_shard<'a>(
    dataset: &'a Dataset,
    session: &'a SessionEntry,
) -> Option<&'a ShardEntry> {
    let mut shards = dataset.shards_of(&session.id);
    let first = shards.next()?;
    (shards.next().is_none() && (1..=MAX_SAMPLES).contains(&session.samples)).then_some(first)
}

fn about(file: &str, what: String) -> Problem {
    Problem {
        file: file.to_owned(),
        sample: None,
        what,
    }
}

fn entries(dataset: &Dataset) -> Vec<Problem> {
    let mut problems = Vec::new();
    let mut wrong = |what: String| problems.push(about(Dataset::FILE, what));
    for (name, count) in counted(dataset.sessions.iter().map(|session| session.id.as_str())) {
        if count > 1 {
            wrong(format!("session {name:?} is listed {count} times"));
        }
    }
    for (file, count) in counted(dataset.files()) {
        if count > 1 {
            wrong(format!("the file {file:?} is listed {count} times"));
        }
    }
    for session in &dataset.sessions {
        of_session(dataset, session)
            .into_iter()
            .for_each(&mut wrong);
    }
    for shard in &dataset.shards {
        if dataset.session(&shard.session).is_none() {
            wrong(format!(
                "shard {:?} is of the unknown session {:?}",
                shard.file, shard.session
            ));
        }
    }
    problems
}

fn of_session(dataset: &Dataset, session: &SessionEntry) -> Vec<String> {
    let SessionEntry { id, samples, .. } = session;
    let mut problems = Vec::new();
    let count = dataset.shards_of(id).count();
    if count != 1 {
        problems.push(format!(
            "session {id:?} has {count} shards where 1 was expected"
        ));
    }
    if *samples != dataset.settings.frames || !(1..=MAX_SAMPLES).contains(samples) {
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

/// Each name with the number of times it occurs, in the order of first occurrence.
fn counted<'a>(names: impl Iterator<Item = &'a str>) -> Vec<(&'a str, u32)> {
    let mut places = HashMap::new();
    let mut counts: Vec<(&str, u32)> = Vec::new();
    for name in names {
        let place = *places.entry(name).or_insert(counts.len());
        match counts.get_mut(place) {
            Some((_, count)) => *count += 1,
            None => counts.push((name, 1)),
        }
    }
    counts
}

/// Shards, tables, images and temporary files in the folder that no entry vouches for.
fn strays(out: &Path, dataset: &Dataset) -> Result<Vec<Problem>, Error> {
    let known: HashSet<&str> = dataset.files().collect();
    let mut problems = Vec::new();
    for name in output::names_in(out)? {
        if names::is_leftover(&name) {
            problems.push(about(
                &name,
                "an interrupted writer left it behind".to_owned(),
            ));
        } else if is_data(&name) && !known.contains(name.as_str()) {
            problems.push(unknown(&name));
        }
    }
    for folder in [names::IMAGES, names::MASKS, names::MEANS] {
        for name in output::names_in(&out.join(folder))? {
            let path = format!("{folder}/{name}");
            if !known.contains(path.as_str()) {
                problems.push(unknown(&path));
            }
        }
    }
    Ok(problems)
}

fn unknown(file: &str) -> Problem {
    about(file, "dataset.json does not vouch for it".to_owned())
}

fn is_data(name: &str) -> bool {
    [".tar", ".parquet", ".png"]
        .iter()
        .any(|end| name.ends_with(end))
}
