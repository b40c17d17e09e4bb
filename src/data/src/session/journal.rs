//! The journal of a turn: what the turntable reported while the frames were recorded, so that a
//! recording that is interrupted keeps its angles (`turn.jsonl`).
//!
//! The first line is the turn as it was planned, each further one a report. It is written beside the
//! frame index and removed when the session is complete, whose index has all angles then.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::turn_motion::{JournaledReport, JournaledTurn};

/// Name of the journal in a session folder.
pub const JOURNAL_FILE: &str = "turn.jsonl";
/// Most reports of one turn: an hour at 15 a second.
const MAX_REPORTS: usize = 54_000;

/// A turn, and what the table reported of it so far.
#[derive(Debug, Clone, PartialEq)]
pub struct TurnJournal {
    /// The turn as it was planned.
    pub turn: JournaledTurn,
    /// The reports in order of time.
    pub reports: Vec<JournaledReport>,
}

impl TurnJournal {
    /// Reads a journal up to its first invalid line: after a power cut the end of the file can
    /// hold anything. `None` if not even the turn can be read.
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let mut lines = bytes.split_inclusive(|&byte| byte == b'\n');
        let turn = serde_json::from_slice(lines.next()?).ok()?;
        let reports = lines.map_while(|line| serde_json::from_slice(line).ok());
        Some(Self {
            turn,
            reports: reports.take(MAX_REPORTS).collect(),
        })
    }

    /// Reads the journal of a session folder; `None` if there is none.
    pub fn read(folder: &Path) -> Option<Self> {
        Self::parse(&fs::read(folder.join(JOURNAL_FILE)).ok()?)
    }
}

/// A journal that is being written.
#[derive(Debug)]
pub(super) struct JournalWriter {
    file: File,
    path: PathBuf,
    journal: TurnJournal,
}

impl JournalWriter {
    /// Starts the journal of a turn in a session folder.
    pub(super) fn create(folder: &Path, turn: JournaledTurn) -> io::Result<Self> {
        let path = folder.join(JOURNAL_FILE);
        let file = OpenOptions::new()
            .create_new(true)
            .append(true)
            .open(&path)?;
        let mut writer = Self {
            file,
            path,
            journal: TurnJournal {
                turn,
                reports: Vec::new(),
            },
        };
        writer.append(&turn)?;
        Ok(writer)
    }

    /// Adds a report. Those beyond the limit are left out.
    pub(super) fn add(&mut self, report: JournaledReport) -> io::Result<()> {
        if self.journal.reports.len() < MAX_REPORTS {
            self.append(&report)?;
            self.journal.reports.push(report);
        }
        Ok(())
    }

    fn append(&mut self, line: &impl Serialize) -> io::Result<()> {
        let mut line = serde_json::to_vec(line).map_err(io::Error::other)?;
        line.push(b'\n');
        self.file.write_all(&line)
    }

    pub(super) fn journal(&self) -> &TurnJournal {
        &self.journal
    }

    pub(super) fn sync(&self) -> io::Result<()> {
        self.file.sync_data()
    }

    /// Removes the file: all angles are in the index.
    pub(super) fn remove(self) -> io::Result<()> {
        fs::remove_file(&self.path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURN: JournaledTurn = JournaledTurn {
        from_deg: -2.0,
        to_deg: 362.0,
        degrees_per_second: 7.2,
        zero_deg: 0.0,
        step_deg: 0.011,
    };

    fn report(n: i64) -> JournaledReport {
        JournaledReport {
            asked_us: n * 66_667,
            came_us: n * 66_667 + 4000,
            chip_us: (n % 2 == 0).then_some(n as u32 * 66_667),
            machine_deg: n as f64 * 0.48,
        }
    }

    #[test]
    fn a_journal_is_read_as_it_was_written_and_up_to_its_first_torn_line() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(TurnJournal::read(folder.path()), None);
        let mut writer = JournalWriter::create(folder.path(), TURN).unwrap();
        (0..5).for_each(|n| writer.add(report(n)).unwrap());
        let read = TurnJournal::read(folder.path()).unwrap();
        assert_eq!(&read, writer.journal());
        assert_eq!(read.reports.len(), 5);

        let path = folder.path().join(JOURNAL_FILE);
        let bytes = fs::read(&path).unwrap();
        let torn = TurnJournal::parse(&bytes[..bytes.len() - 9]).unwrap();
        assert_eq!(torn.reports, read.reports[..4]);
        let zeros = [&bytes[..], &[0; 50]].concat();
        assert_eq!(TurnJournal::parse(&zeros).unwrap(), read);
        assert_eq!(TurnJournal::parse(b""), None);
        writer.remove().unwrap();
        assert!(!path.exists());
    }
}
