//! Where recordings come from and extracted sessions go to, around an extraction on the local disk.

use std::path::{Path, PathBuf};

use relit_data::shard::Dataset;

use super::ExtractError;

/// Brings recordings to the local disk, and takes sessions away from there.
pub(super) trait StorageBackend {
    /// The recording as a file or folder on the local disk.
    fn fetch(&self, recording: &Path) -> Result<PathBuf, ExtractError>;

    /// Whether the files of a session that the data set lists are as it says; `out` is the folder on the local
    /// disk.
    fn holds(&self, dataset: &Dataset, out: &Path, session: &str) -> bool;

    /// The recording is done with, and what became of it is noted. `extracted` is the session that it was
    /// extracted to just now.
    fn ended(
        &self,
        recording: &Path,
        dataset: &Dataset,
        extracted: Option<&str>,
    ) -> Result<(), ExtractError>;
}

/// Everything is on the local disk, and stays there.
pub(super) struct LocalDisk;

impl StorageBackend for LocalDisk {
    fn fetch(&self, recording: &Path) -> Result<PathBuf, ExtractError> {
        Ok(recording.to_owned())
    }

    fn holds(&self, dataset: &Dataset, out: &Path, session: &str) -> bool {
        dataset.check_integrity(out, session).is_ok()
    }

    fn ended(&self, _: &Path, _: &Dataset, _: Option<&str>) -> Result<(), ExtractError> {
        Ok(())
    }
}
