//! What a run leaves to be plotted: a table in CSV.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use crate::error::TrainError;

/// The table's file.
pub const TABLE: &str = "losses.csv";

/// A table `step,series,value`, grown line by line.
#[derive(Debug)]
pub struct MetricsLog {
    table: File,
    table_path: PathBuf,
}

impl MetricsLog {
    /// The log in a run's folder; a resumed run continues after the line of its last step.
    ///
    /// # Errors
    /// [`TrainError::Io`], [`TrainError::Refused`] if another program has it open.
    pub fn open(folder: &Path, from_step: u64) -> Result<Self, TrainError> {
        let running = || {
            TrainError::Refused(format!(
                "another program is writing the run in {}: wait until it ends, or give another folder",
                folder.display()
            ))
        };
        if Self::is_open(folder) {
            return Err(running());
        }
        let table_path = folder.join(TABLE);
        let table =
            open_table(&table_path, from_step).map_err(TrainError::io(&table_path, "written"))?;
        // Some file systems have no locks.
        if matches!(table.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(running());
        }
        Ok(Self { table, table_path })
    }

    /// Whether a run in a folder has its log open.
    pub fn is_open(folder: &Path) -> bool {
        let table = OpenOptions::new().append(true).open(folder.join(TABLE));
        table.is_ok_and(|table| matches!(table.try_lock(), Err(TryLockError::WouldBlock)))
    }

    /// Writes the values of a step.
    ///
    /// # Errors
    /// [`TrainError::Io`].
    pub fn scalars(&mut self, step: u64, values: &BTreeMap<String, f64>) -> Result<(), TrainError> {
        let lines: String = values
            .iter()
            .map(|(name, value)| format!("{step},{name},{value}\n"))
            .collect();
        self.table
            .write_all(lines.as_bytes())
            .map_err(TrainError::io(&self.table_path, "written"))
    }
}

/// Opens the table without the lines of steps after `from_step`, which a resumed run repeats.
fn open_table(path: &Path, from_step: u64) -> io::Result<File> {
    let kept = match std::fs::read_to_string(path) {
        Ok(text) => {
            let is_kept = |line: &&str| {
                let step = line
                    .split(',')
                    .next()
                    .and_then(|step| step.parse::<u64>().ok());
                step.is_some_and(|step| step <= from_step)
            };
            text.lines()
                .filter(is_kept)
                .map(|line| format!("{line}\n"))
                .collect()
        }
        Err(error) if error.kind() == io::ErrorKind::NotFound => String::new(),
        Err(error) => return Err(error),
    };
    relit_data::durable::write_whole(path, format!("step,series,value\n{kept}").as_bytes())?;
    OpenOptions::new().append(true).open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_resumed_run_does_not_write_its_lines_twice() {
        let folder = tempfile::tempdir().unwrap();
        let values = |loss: f64| BTreeMap::from([("loss".to_owned(), loss)]);
        let mut metrics_log = MetricsLog::open(folder.path(), 0).unwrap();
        for step in 1..=4 {
            metrics_log.scalars(step, &values(step as f64)).unwrap();
        }
        drop(metrics_log);
        let mut metrics_log = MetricsLog::open(folder.path(), 2).unwrap();
        metrics_log.scalars(3, &values(0.5)).unwrap();
        let table = std::fs::read_to_string(folder.path().join(TABLE)).unwrap();
        assert_eq!(table, "step,series,value\n1,loss,1\n2,loss,2\n3,loss,0.5\n");
    }

    #[test]
    fn a_journal_is_open_until_it_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!MetricsLog::is_open(folder.path()));
        let metrics_log = MetricsLog::open(folder.path(), 0).unwrap();
        assert!(MetricsLog::is_open(folder.path()));
        drop(metrics_log);
        assert!(!MetricsLog::is_open(folder.path()));
    }
}
