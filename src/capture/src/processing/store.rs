//! What is kept of the processing when the program ends: whether takes are processed by themselves. What was done
//! is in the sessions and the data set themselves.

use std::path::{Path, PathBuf};
use std::{fs, io};

use relit_data::durable;
use serde::{Deserialize, Serialize};

/// The file's name, in the folder of sessions. Its leading dot keeps it apart from recordings.
const FILE: &str = ".processing.json";

/// What a person decides about processing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ProcessingSettings {
    /// Whether each usable take is processed once the rig rests.
    pub when_done: bool,
}

impl ProcessingSettings {
    /// What is kept in a folder of sessions; the defaults if the file does not exist.
    pub(super) fn read(root: &Path) -> io::Result<Self> {
        match fs::read(path(root)) {
            Ok(bytes) => Ok(serde_json::from_slice(&bytes)?),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Self::default()),
            Err(error) => Err(error),
        }
    }

    pub(super) fn write(self, root: &Path) -> io::Result<()> {
        durable::write_whole(&path(root), &serde_json::to_vec_pretty(&self)?)
    }
}

/// Where it is kept.
pub(super) fn path(root: &Path) -> PathBuf {
    root.join(FILE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_read_as_they_were_written_and_damaged_ones_refused() {
        let root = tempfile::tempdir().unwrap();
        let read = || ProcessingSettings::read(root.path());
        assert_eq!(read().unwrap(), ProcessingSettings::default());
        let settings = ProcessingSettings { when_done: true };
        settings.write(root.path()).unwrap();
        assert_eq!(read().unwrap(), settings);
        fs::write(path(root.path()), "{").unwrap();
        assert!(read().is_err());
    }
}
