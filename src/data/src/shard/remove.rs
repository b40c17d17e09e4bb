//! Sessions taken out of a data set.

use std::fs;
use std::io;
use std::path::Path;

use super::ShardError;
use super::dataset::{Dataset, SessionEntry};
use super::output::OutputFolder;

/// Removes sessions from the data set in `out`, first from its description and then their files, and returns their entries.
///
/// # Errors
/// [`ShardError::Refused`] if one of these names is not that of a session: then nothing is removed;
/// [`ShardError::Locked`] while the data set is being written; [`ShardError::Io`]; those of [`Dataset::read`].
pub fn remove_sessions(out: &Path, ids: &[String]) -> Result<Vec<SessionEntry>, ShardError> {
    // Locked first: what another program writes until then is not lost.
    let _lock = OutputFolder::lock_existing(out)?;
    let mut dataset = Dataset::read(out)?;
    let mut removed = Vec::new();
    let mut files = Vec::new();
    for id in ids {
        let Some(entry) = dataset.session(id) else {
            return Err(ShardError::Refused(format!(
                "{} has no session {id}: relit-extract stats prints their names",
                out.display()
            )));
        };
        removed.push(entry.clone());
        files.extend(dataset.files_of(id).map(|(file, _)| out.join(file)));
        dataset.remove(id);
    }
    dataset.write(out)?;
    for file in &files {
        let gone = if file.is_dir() {
            fs::remove_dir_all(file)
        } else {
            fs::remove_file(file)
        };
        match gone {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                return Err(ShardError::io("remove", file)(error));
            }
            _ => {}
        }
    }
    Ok(removed)
}
