//! A run on disk: one complete file or none, from which the run resumes with the same losses.

use std::collections::HashMap;
use std::fs;
use std::path::{Path, PathBuf};

use relit_data::durable;
use safetensors::SafeTensors;

use crate::error::TrainError;
use relight_photo::nets::Weights;

const SCHEMA: &str = "relight.checkpoint/1";
/// The file in a run's folder.
pub const CHECKPOINT: &str = "checkpoint.safetensors";

/// The state of a run after some steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Checkpoint {
    /// What is trained.
    pub task: String,
    /// Steps made.
    pub step: u64,
    /// The settings, as TOML: another run's are refused.
    pub settings: String,
    /// The inputs of the run besides its settings: those of another run are refused.
    pub inputs: String,
    /// The cursor in the data; the file names it `place`.
    pub cursor: String,
    /// Networks, averages and optimisers.
    pub state: Weights,
}

impl Checkpoint {
    /// Its path in a run's folder.
    pub fn path(folder: &Path) -> PathBuf {
        folder.join(CHECKPOINT)
    }

    /// Writes it into a run's folder in place of the one before.
    ///
    /// # Errors
    /// [`TrainError::Io`]: the one before is still whole.
    pub fn write(&self, folder: &Path) -> Result<(), TrainError> {
        let path = Self::path(folder);
        let facts = HashMap::from([
            ("schema".to_owned(), SCHEMA.to_owned()),
            ("task".to_owned(), self.task.clone()),
            ("step".to_owned(), self.step.to_string()),
            ("settings".to_owned(), self.settings.clone()),
            ("inputs".to_owned(), self.inputs.clone()),
            ("place".to_owned(), self.cursor.clone()),
        ]);
        let bytes = self
            .state
            .to_safetensors(relight_photo::nets::WeightPrecision::Single, Some(facts))
            .map_err(|fault| TrainError::checkpoint(&path, &fault))?;
        durable::write_whole(&path, &bytes).map_err(TrainError::io(&path, "written"))
    }

    /// Reads the checkpoint in a run's folder; `None` if it has none.
    ///
    /// # Errors
    /// [`TrainError::Io`] or [`TrainError::Refused`].
    pub fn read(folder: &Path) -> Result<Option<Self>, TrainError> {
        let path = Self::path(folder);
        let bytes = match fs::read(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(TrainError::io(&path, "read")(source)),
        };
        let found = Self::from_bytes(&bytes);
        found
            .map(Some)
            .map_err(|fault| TrainError::checkpoint(&path, &fault))
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        let (_, header) = SafeTensors::read_metadata(bytes).map_err(|error| error.to_string())?;
        let facts = header.metadata().as_ref();
        let fact = |name: &str| {
            facts
                .and_then(|facts| facts.get(name))
                .cloned()
                .ok_or_else(|| format!("it has no {name}"))
        };
        if fact("schema")? != SCHEMA {
            return Err(format!("it is not a {SCHEMA}"));
        }
        Ok(Self {
            task: fact("task")?,
            step: fact("step")?
                .parse()
                .map_err(|_| "its step is not a number")?,
            settings: fact("settings")?,
            inputs: fact("inputs")?,
            cursor: fact("place")?,
            state: Weights::from_bytes(bytes)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relight_photo::nets::decomposer;

    fn checkpoint() -> Checkpoint {
        Checkpoint {
            task: "decompose".to_owned(),
            step: 12,
            settings: "steps = 3".to_owned(),
            inputs: String::new(),
            cursor: String::new(),
            state: Weights::initial(&decomposer(), 1),
        }
    }

    #[test]
    fn what_was_written_is_read_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(Checkpoint::read(folder.path()).unwrap(), None);
        checkpoint().write(folder.path()).unwrap();
        assert_eq!(Checkpoint::read(folder.path()).unwrap(), Some(checkpoint()));
    }

    #[test]
    fn a_file_that_is_cut_short_or_is_something_else_is_told() {
        let folder = tempfile::tempdir().unwrap();
        checkpoint().write(folder.path()).unwrap();
        let path = Checkpoint::path(folder.path());
        let bytes = fs::read(&path).unwrap();
        for damaged in [&bytes[..bytes.len() / 2], b"", b"hello"] {
            fs::write(&path, damaged).unwrap();
            let error = Checkpoint::read(folder.path()).unwrap_err();
            assert!(matches!(error, TrainError::Refused(_)), "{error:?}");
            let name = path.display().to_string();
            assert!(error.to_string().contains(&name), "{error}");
        }
        let weights = Weights::initial(&decomposer(), 1);
        weights
            .write(&path, relight_photo::nets::WeightPrecision::Half)
            .unwrap();
        assert!(Checkpoint::read(folder.path()).is_err());
    }
}
