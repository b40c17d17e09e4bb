//! The description of what is extracted: that of the data set, or a task's part of it.

use std::path::{Path, PathBuf};

use relit_data::causes::with_causes;
use relit_data::shard::{
    Dataset, ExtractionSettings, OutputFolder, PartialManifest, SessionEntry, ShardEntry,
    ShardError, TaskOutcome,
};

use super::{ExtractError, ExtractOptions, RecordingOutcome};

/// The description in the output folder.
pub(super) enum DatasetIndex {
    /// `dataset.json`.
    Whole(Dataset),
    /// A task's part.
    Partial(Box<PartialManifest>),
}

impl DatasetIndex {
    /// That in the folder, or a new one. A task's part of an earlier run over other recordings is started
    /// again, with the sessions that it holds.
    pub(super) fn open(
        folder: &OutputFolder,
        found: &[PathBuf],
        options: &ExtractOptions,
    ) -> Result<Self, ExtractError> {
        let (out, settings) = (folder.path(), options.settings());
        let Some(task) = options.task else {
            let dataset = match Dataset::read(out) {
                Ok(existing) => existing,
                Err(ShardError::NoDataset(_)) => Dataset::new(settings.clone()),
                Err(error) => return Err(error.into()),
            };
            check_settings(out, &dataset.settings, &settings)?;
            return Ok(Self::Whole(dataset));
        };
        let name = |path: &PathBuf| {
            let name = path.file_name().unwrap_or(path.as_os_str());
            name.to_string_lossy().into_owned()
        };
        let dataset = match PartialManifest::read(out, task)? {
            Some(partial) => partial.dataset,
            None => Dataset::new(settings.clone()),
        };
        check_settings(out, &dataset.settings, &settings)?;
        let partial = PartialManifest::new(task, found.iter().map(name).collect(), dataset);
        // A task without recordings has a part too, so that none is missing.
        partial.write(out)?;
        Ok(Self::Partial(Box::new(partial)))
    }

    pub(super) fn dataset(&self) -> &Dataset {
        match self {
            Self::Whole(dataset) => dataset,
            Self::Partial(partial) => &partial.dataset,
        }
    }

    /// What a resumed task may take over: the folder's `dataset.json`, of a run without tasks or with another number of
    /// them, if it has the same settings.
    pub(super) fn earlier(
        out: &Path,
        options: &ExtractOptions,
    ) -> Result<Option<Dataset>, ExtractError> {
        if options.task.is_none() || !options.resume {
            return Ok(None);
        }
        match Dataset::read(out) {
            Ok(whole) => {
                let differences = whole.settings.differences(&options.settings());
                Ok(differences.is_empty().then_some(whole))
            }
            Err(ShardError::NoDataset(_)) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Takes a session of an earlier data set into a task's part that lacks it.
    pub(super) fn adopt(&mut self, earlier: &Dataset, id: &str) {
        if let Self::Partial(partial) = self
            && partial.dataset.session(id).is_none()
            && let Some(entry) = earlier.session(id)
        {
            let shards = earlier.shards_of(id).cloned().collect();
            partial.dataset.replace(entry.clone(), shards);
        }
    }

    /// Adds a session; an older one of the same id is replaced.
    pub(super) fn add(
        &mut self,
        folder: &OutputFolder,
        entry: SessionEntry,
        shards: Vec<ShardEntry>,
    ) -> Result<(), ExtractError> {
        match self {
            // A description that could not be written does not replace the one in memory.
            Self::Whole(dataset) => {
                let mut changed = dataset.clone();
                changed.replace(entry, shards);
                changed.write(folder.path())?;
                *dataset = changed;
            }
            // It is written with the outcome.
            Self::Partial(partial) => partial.dataset.replace(entry, shards),
        }
        Ok(())
    }

    /// Notes what became of a task's recording.
    pub(super) fn note(
        &mut self,
        folder: &OutputFolder,
        position: usize,
        outcome: &RecordingOutcome,
    ) -> Result<(), ExtractError> {
        let Self::Partial(partial) = self else {
            return Ok(());
        };
        let outcome = match outcome {
            RecordingOutcome::Extracted(entry) | RecordingOutcome::Skipped(entry) => {
                TaskOutcome::Extracted {
                    session: entry.id.clone(),
                }
            }
            RecordingOutcome::LeftOut(error) => TaskOutcome::LeftOut {
                why: with_causes(error),
            },
            RecordingOutcome::Failed(error) => TaskOutcome::Failed {
                why: with_causes(error),
            },
        };
        partial.outcomes.insert(position, outcome);
        Ok(partial.write(folder.path())?)
    }
}

fn check_settings(
    out: &Path,
    old: &ExtractionSettings,
    new: &ExtractionSettings,
) -> Result<(), ExtractError> {
    let differences = old.differences(new);
    if differences.is_empty() {
        return Ok(());
    }
    Err(ExtractError::Refused(format!(
        "{} holds a data set with other settings ({}): give the same ones, or another folder",
        out.display(),
        differences.join("; ")
    )))
}
