//! What is kept of the processing when the program ends: settings, and what is not done yet. What was done is in the
//! sessions and the data set themselves.

use std::path::{Path, PathBuf};
use std::{fs, io};

use relit_data::durable;
use relit_data::naming::is_session_name;
use serde::{Deserialize, Serialize};

use super::queue::PendingWork;

/// The file's name, in the folder of sessions. It begins with a dot: nobody takes it for a recording.
const FILE: &str = ".processing.json";
const SCHEMA: &str = "relit.processing/1";
/// The data set's name, unless another is given.
pub(super) const DATASET: &str = "dataset";

/// What a person decides about processing.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct ProcessingSettings {
    /// Whether each usable take is processed once the rig rests.
    pub(super) when_done: bool,
    /// The data set's name.
    pub(super) dataset: String,
}

impl Default for ProcessingSettings {
    fn default() -> Self {
        Self {
            when_done: false,
            dataset: DATASET.to_owned(),
        }
    }
}

/// The file's content.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct KeptProcessing {
    schema: String,
    pub(super) settings: ProcessingSettings,
    pub(super) pending: Vec<PendingWork>,
}

impl KeptProcessing {
    pub(super) fn new(settings: ProcessingSettings, pending: Vec<PendingWork>) -> Self {
        Self {
            schema: SCHEMA.to_owned(),
            settings,
            pending,
        }
    }

    /// What is kept in a folder of sessions; nothing where there is no such file.
    pub(super) fn read(root: &Path) -> io::Result<Self> {
        let path = path(root);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => {
                return Ok(Self::new(ProcessingSettings::default(), Vec::new()));
            }
            Err(error) => return Err(error),
        };
        let wrong = |why: String| io::Error::new(io::ErrorKind::InvalidData, why);
        let kept: Self =
            serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))?;
        match kept.schema == SCHEMA && is_session_name(&kept.settings.dataset) {
            true => Ok(kept),
            false => Err(wrong(format!("it is no {SCHEMA}"))),
        }
    }

    pub(super) fn write(&self, root: &Path) -> io::Result<()> {
        durable::write_whole(&path(root), &serde_json::to_vec_pretty(self)?)
    }
}

/// Where it is kept.
pub(super) fn path(root: &Path) -> PathBuf {
    root.join(FILE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::ProcessingStep;

    #[test]
    fn settings_and_pending_work_are_read_as_they_were_written() {
        let root = tempfile::tempdir().unwrap();
        let nothing = KeptProcessing::read(root.path()).unwrap();
        assert_eq!(nothing.settings, ProcessingSettings::default());
        let settings = ProcessingSettings {
            when_done: true,
            dataset: "mugs".to_owned(),
        };
        let work = PendingWork {
            session: Some("mug".to_owned()),
            steps: vec![ProcessingStep::Check],
        };
        let kept = KeptProcessing::new(settings, vec![work]);
        kept.write(root.path()).unwrap();
        assert_eq!(KeptProcessing::read(root.path()).unwrap(), kept);
    }

    #[test]
    fn a_file_that_is_damaged_or_leads_elsewhere_is_refused() {
        let root = tempfile::tempdir().unwrap();
        for text in [
            "{",
            r#"{"schema":"relit.processing/2","settings":{"when_done":true,"dataset":"x"},"pending":[]}"#,
            r#"{"schema":"relit.processing/1","settings":{"when_done":true,"dataset":"../x"},"pending":[]}"#,
        ] {
            fs::write(path(root.path()), text).unwrap();
            assert!(KeptProcessing::read(root.path()).is_err(), "{text}");
        }
    }
}
