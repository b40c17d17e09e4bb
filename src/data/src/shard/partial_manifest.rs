//! Data sets that are written by several tasks, on one machine or many, and joined afterwards.
//!
//! Each task writes the shards of its part of the recordings and its own piece of the description,
//! `tasks/<task>-of-<count>.json`. [`merge`] joins the pieces to `dataset.json`.

use std::collections::BTreeMap;
use std::path::Path;
use std::{fmt, fs, io};

use serde::{Deserialize, Serialize};

use super::dataset::{Dataset, described, json_of};
use super::output;
use super::output::OutputFolder;
use super::{ShardError, names};

/// The schema that this version writes and reads.
const SCHEMA: &str = "relit.task/1";
/// Largest number of tasks.
pub const MAX_TASKS: u32 = 100_000;

/// One of several tasks that write a data set together, as those of a cluster's job array.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct ArrayTask {
    index: u32,
    count: u32,
}

impl ArrayTask {
    /// Task `index` (from 0) of `count`; `None` if there is none, or if there are more than
    /// [`MAX_TASKS`].
    pub fn new(index: u32, count: u32) -> Option<Self> {
        (index < count && count <= MAX_TASKS).then_some(Self { index, count })
    }

    /// How many tasks there are.
    pub fn count(self) -> u32 {
        self.count
    }

    /// Whether the recording at this position of the list of all is this task's.
    pub fn takes(self, position: usize) -> bool {
        position % self.count as usize == self.index as usize
    }

    /// The file of its piece, relative to the data set.
    pub fn file(self) -> String {
        format!("{}/{self}.json", names::TASKS)
    }
}

impl fmt::Display for ArrayTask {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}-of-{}", self.index, self.count)
    }
}

/// What became of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "outcome")]
pub enum TaskOutcome {
    /// It is in the piece's sessions.
    Extracted {
        /// The session's id.
        session: String,
    },
    /// It holds too little of a turn.
    LeftOut {
        /// Why.
        why: String,
    },
    /// It could not be extracted.
    Failed {
        /// Why.
        why: String,
    },
}

/// A task's piece of the description.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartialManifest {
    schema: String,
    task: u32,
    count: u32,
    /// The names of all recordings, of all tasks, in the order in which they share them.
    pub recordings: Vec<String>,
    /// The outcomes of this task's recordings, by position in that list.
    pub outcomes: BTreeMap<usize, TaskOutcome>,
    /// This task's sessions and shards.
    pub dataset: Dataset,
}

impl PartialManifest {
    /// A piece without outcomes.
    pub fn new(task: ArrayTask, recordings: Vec<String>, dataset: Dataset) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            task: task.index,
            count: task.count,
            recordings,
            outcomes: BTreeMap::new(),
            dataset,
        }
    }

    /// The piece that the task wrote into the data set `out`, if there is one.
    ///
    /// # Errors
    /// [`ShardError::Description`] if it cannot be read, [`ShardError::Io`].
    pub fn read(out: &Path, task: ArrayTask) -> Result<Option<Self>, ShardError> {
        let path = out.join(task.file());
        match fs::read(&path) {
            Ok(bytes) => Self::parse(&path, &bytes).map(Some),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(ShardError::io("read", &path)(error)),
        }
    }

    /// Writes the piece into the data set `out`, whole or not at all.
    ///
    /// # Errors
    /// [`ShardError::Refused`] if a number is not finite, [`ShardError::Io`].
    pub fn write(&self, out: &Path) -> Result<(), ShardError> {
        let (index, count) = (self.task, self.count);
        let file = ArrayTask { index, count }.file();
        output::write_whole(out, &file, &json_of(self, &file)?).map(|_| ())
    }

    fn parse(path: &Path, bytes: &[u8]) -> Result<Self, ShardError> {
        let partial: Self = described(path, bytes, SCHEMA)?;
        partial.dataset.check_names()?;
        Ok(partial)
    }
}

/// What was joined.
#[derive(Debug, Clone, PartialEq)]
pub struct MergedDataset {
    /// The description, as it was written.
    pub dataset: Dataset,
    /// Number of tasks.
    pub tasks: u32,
    /// Recordings that hold too little of a turn: name and reason.
    pub left_out: Vec<(String, String)>,
    /// Recordings that could not be extracted: name and reason.
    pub failed: Vec<(String, String)>,
}

/// Joins the pieces in the data set `out` and writes its `dataset.json`: the same bytes as one run over all
/// recordings writes, also where some of them fail. It can be repeated, and changes nothing else. `length` is that of a file of the data set, or of
/// anything for a folder of images, or an error if the file does not exist.
///
/// # Errors
/// [`ShardError::PartialManifests`] if a task or a recording is missing or is there twice, if all failed, if tasks saw
/// different recordings or settings, or a file is missing; then nothing is written.
/// [`ShardError::Locked`] while a task is running, [`ShardError::Description`], [`ShardError::Io`].
pub fn merge(
    out: &Path,
    length: &dyn Fn(&str) -> io::Result<u64>,
) -> Result<MergedDataset, ShardError> {
    let folder = OutputFolder::lock_existing(out)?;
    let partials = read_partials(out)?;
    let mut problems = Vec::new();
    let merged = join(&partials, &mut problems);
    if let Some(merged) = &merged {
        problems.extend(missing_files(&merged.dataset, length));
        problems.extend(not_of_a_task(out, &merged.dataset)?);
        if merged.dataset.sessions.is_empty() {
            let failed = merged.failed.iter();
            problems.extend(failed.map(|(name, why)| format!("{name}: {why}")));
        }
    }
    match merged.filter(|_| problems.is_empty()) {
        Some(merged) => {
            merged.dataset.write(folder.path())?;
            Ok(merged)
        }
        None => Err(ShardError::PartialManifests {
            path: out.join(names::TASKS),
            problems,
        }),
    }
}

/// The description of the data set in `out`. Where there is none yet, that of what the tasks have written so far, and a
/// sentence that says so.
///
/// # Errors
/// As [`Dataset::read`].
pub fn read_partial(out: &Path) -> Result<(Dataset, Option<String>), ShardError> {
    let none = match Dataset::read(out) {
        Err(none @ ShardError::NoDataset(_)) => none,
        read => return Ok((read?, None)),
    };
    let partials = read_partials(out)?;
    let Some(first) = partials.first() else {
        return Err(none);
    };
    let mut dataset = Dataset::new(first.dataset.settings.clone());
    for partial in &partials {
        for entry in &partial.dataset.sessions {
            dataset.replace(entry.clone(), Vec::new());
        }
    }
    let done: usize = partials.iter().map(|partial| partial.outcomes.len()).sum();
    let problem = format!(
        "this is what {} of {} tasks have written so far, {done} of {} recordings: when all are done, run relit-extract merge {}",
        partials.len(),
        first.count,
        first.recordings.len(),
        out.display()
    );
    Ok((dataset, Some(problem)))
}

/// The pieces of all tasks that are there.
fn read_partials(out: &Path) -> Result<Vec<PartialManifest>, ShardError> {
    let folder = out.join(names::TASKS);
    let files = output::names_in(&folder)?;
    let partials = files
        .iter()
        .filter(|name| !name.starts_with('.') && name.ends_with(".json"));
    partials
        .map(|name| {
            let path = folder.join(name);
            let bytes = fs::read(&path).map_err(ShardError::io("read", &path))?;
            PartialManifest::parse(&path, &bytes)
        })
        .collect()
}

/// The pieces joined, and what is wrong with them; `None` if they do not belong together.
fn join(partials: &[PartialManifest], problems: &mut Vec<String>) -> Option<MergedDataset> {
    let Some(first) = partials.first() else {
        problems.push("there are none".to_owned());
        return None;
    };
    for partial in partials {
        let (a, b) = (first.task, partial.task);
        let problem = if partial.count != first.count {
            let (a, b) = (first.count, partial.count);
            format!("some are of {a} tasks, others of {b}: remove those of an earlier run")
        } else if partial.recordings != first.recordings {
            format!(
                "tasks {a} and {b} saw different recordings: run them again with the same inputs"
            )
        } else if partial.dataset.settings != first.dataset.settings {
            format!("tasks {a} and {b} had different settings")
        } else {
            continue;
        };
        problems.push(problem);
        return None;
    }
    let by_task: BTreeMap<u32, &PartialManifest> = partials.iter().map(|p| (p.task, p)).collect();
    let missing: Vec<String> = (0..first.count)
        .filter(|task| !by_task.contains_key(task))
        .map(|task| task.to_string())
        .collect();
    if !missing.is_empty() {
        problems.push(format!("no piece of task {}", missing.join(", ")));
    }
    let mut dataset = Dataset::new(first.dataset.settings.clone());
    let (mut left_out, mut failed) = (Vec::new(), Vec::new());
    for (position, name) in first.recordings.iter().enumerate() {
        let task = (position % first.count as usize) as u32;
        let Some(partial) = by_task.get(&task) else {
            continue;
        };
        match partial.outcomes.get(&position) {
            None => problems.push(format!(
                "task {task} lacks {name}: run it again with --resume"
            )),
            Some(TaskOutcome::Failed { why }) => {
                failed.push((name.clone(), format!("task {task} failed with it: {why}")));
            }
            Some(TaskOutcome::LeftOut { why }) => left_out.push((name.clone(), why.clone())),
            Some(TaskOutcome::Extracted { session }) => {
                let there = dataset.session_alike(session);
                match (there, partial.dataset.session(session)) {
                    (Some(other), _) if other.id == *session => {
                        problems.push(format!("session {session} is there twice"));
                    }
                    (Some(other), _) => problems.push(format!(
                        "the sessions {} and {session} differ only in case, which some file systems ignore: rename one and extract it again",
                        other.id
                    )),
                    (None, Some(entry)) => dataset.replace(
                        entry.clone(),
                        partial.dataset.shards_of(session).cloned().collect(),
                    ),
                    (None, None) => problems.push(format!("the piece of task {task} lacks {session}")),
                }
            }
        }
    }
    Some(MergedDataset {
        dataset,
        tasks: first.count,
        left_out,
        failed,
    })
}

/// Files of the data set that are not there or have another length.
fn missing_files(dataset: &Dataset, length: &dyn Fn(&str) -> io::Result<u64>) -> Vec<String> {
    let ids = dataset.sessions.iter().map(|session| session.id.as_str());
    let files = ids.flat_map(|id| dataset.files_of(id));
    let problem = |(file, bytes): (&str, Option<u64>)| match length(file) {
        Err(error) => Some(format!("{file}: {error}")),
        Ok(found) => bytes
            .filter(|&bytes| bytes != found)
            .map(|bytes| format!("{file} has {found} bytes, not {bytes}")),
    };
    files.filter_map(problem).collect()
}

/// Sessions of an existing description that no task has.
fn not_of_a_task(out: &Path, dataset: &Dataset) -> Result<Vec<String>, ShardError> {
    let existing = match Dataset::read(out) {
        Ok(existing) => existing,
        Err(ShardError::NoDataset(_)) => return Ok(Vec::new()),
        Err(error) => return Err(error),
    };
    let others = existing
        .sessions
        .iter()
        .filter(|session| dataset.session(&session.id).is_none());
    let problem = |id: &str| {
        format!(
            "dataset.json also has session {id}, which belongs to no task: use a separate folder"
        )
    };
    Ok(others.map(|session| problem(&session.id)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_recording_is_one_tasks() {
        for count in [1, 3, 7] {
            for position in 0..20 {
                let takers = (0..count).filter_map(|index| ArrayTask::new(index, count));
                assert_eq!(takers.filter(|task| task.takes(position)).count(), 1);
            }
        }
        assert!(ArrayTask::new(3, 3).is_none() && ArrayTask::new(0, 0).is_none());
    }
}
