//! Finished data sets joined to a new one, whose files are copies of theirs.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::dataset::Dataset;
use super::new_dataset::NewDataset;
use super::output;
use super::{ShardError, names};
use crate::file_names::folded;

/// Joins the data sets in the folders `inputs` to a new one in `out`, whole or not at all: each file is compared with its
/// entry as it is copied. `progress` is called with the samples done and those of all.
///
/// # Errors
/// [`ShardError::Refused`] if their settings differ or two sessions have names that are one on some file system;
/// [`ShardError::Changed`] if a file is not as its `dataset.json` says; [`ShardError::Refused`] if `out` holds anything;
/// [`ShardError::Locked`] while one of them is being written; those of [`Dataset::read`].
pub fn merge_datasets(
    inputs: &[PathBuf],
    out: &Path,
    progress: &dyn Fn(u64, u64),
) -> Result<Dataset, ShardError> {
    let mut datasets = Vec::new();
    let mut locks = Vec::new();
    for input in inputs {
        locks.push(output::lock_for_reading(input)?);
        datasets.push((input.as_path(), Dataset::read(input)?));
    }
    let problems = problems(&datasets);
    let Some((_, first)) = datasets.first().filter(|_| problems.is_empty()) else {
        let why = problems.join("; ");
        return Err(ShardError::Refused(format!(
            "the data sets cannot be merged: {why}"
        )));
    };
    let new = NewDataset::create(out)?;
    let needs = Needs::of(&datasets);
    let mut joined = Dataset::new(first.settings.clone());
    let (mut samples, mut bytes) = (0, 0);
    for (input, dataset) in &datasets {
        for session in &dataset.sessions {
            new.copy_session(input, dataset, session)
                .map_err(|error| error.with_needs("the data set", out, needs.bytes, bytes))?;
            let shards = dataset.shards_of(&session.id).cloned().collect();
            joined.replace(session.clone(), shards);
            samples += u64::from(session.samples);
            bytes += bytes_of(dataset, &session.id);
            progress(samples, needs.samples);
        }
    }
    new.finish(&joined)?;
    Ok(joined)
}

/// What all of them have.
struct Needs {
    samples: u64,
    bytes: u64,
}

impl Needs {
    fn of(datasets: &[(&Path, Dataset)]) -> Self {
        let sessions = datasets.iter().flat_map(|(_, dataset)| {
            dataset
                .sessions
                .iter()
                .map(move |session| (dataset, session))
        });
        let zero = Self {
            samples: 0,
            bytes: 0,
        };
        sessions.fold(zero, |sum, (dataset, session)| Self {
            samples: sum.samples + u64::from(session.samples),
            bytes: sum.bytes + bytes_of(dataset, &session.id),
        })
    }
}

/// Bytes of a session's files, where images are in a folder with those of the folder.
pub(super) fn bytes_of(dataset: &Dataset, id: &str) -> u64 {
    let files = dataset.files_of(id).filter_map(|(_, bytes)| bytes);
    let folders = dataset.shards_of(id).filter(|shard| shard.mask.is_some());
    files.sum::<u64>() + folders.map(|shard| shard.bytes).sum::<u64>()
}

/// Why data sets cannot be joined, one sentence each.
fn problems(datasets: &[(&Path, Dataset)]) -> Vec<String> {
    let mut problems = Vec::new();
    let Some(((place, first), others)) = datasets.split_first() else {
        return vec!["none are given".to_owned()];
    };
    for (other, dataset) in others {
        let differences = first.settings.differences(&dataset.settings);
        if !differences.is_empty() {
            problems.push(format!(
                "{} and {} have different settings ({})",
                place.display(),
                other.display(),
                differences.join("; ")
            ));
        }
    }
    let mut known: BTreeMap<String, (&Path, &str)> = BTreeMap::new();
    for (place, dataset) in datasets {
        for session in &dataset.sessions {
            let id = session.id.as_str();
            match known.get(&folded(id)) {
                None => {
                    known.insert(folded(id), (place, id));
                }
                Some((other, known)) if *known == id => problems.push(format!(
                    "the session {id} is in {} and in {}",
                    other.display(),
                    place.display()
                )),
                Some((other, known)) => problems.push(format!(
                    "the sessions {known} in {} and {id} in {} differ only in case, which some file systems ignore",
                    other.display(),
                    place.display()
                )),
            }
        }
        let alone = dataset
            .sessions
            .iter()
            .filter(|session| dataset.shards_of(&session.id).next().is_none());
        problems.extend(alone.map(|session| {
            format!(
                "{} has no shard of {}",
                place.join(Dataset::FILE).display(),
                session.id
            )
        }));
    }
    problems
}

/// Whether a data set consists of tasks' pieces that nobody has merged.
pub fn has_only_partial_manifests(out: &Path) -> bool {
    !out.join(Dataset::FILE).exists() && out.join(names::TASKS).is_dir()
}
