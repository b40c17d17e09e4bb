//! What a run leaves to be plotted: a CSV table, and an event file of TensorBoard.
//!
//! An event file is a sequence of TFRecords (length, its checksum, data, their checksum; the masked CRC-32C), each an
//! `Event` of tensorboard/compat/proto/event.proto, of which scalars and pictures are written.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use crc::{CRC_32_ISCSI, Crc};
use prost::Message;

use super::error::TrainError;

const CASTAGNOLI: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);
/// The table's file.
pub const TABLE: &str = "losses.csv";

/// A table `step,series,value` and an event file, both grown line by line.
#[derive(Debug)]
pub struct Journal {
    table: File,
    table_path: PathBuf,
    events: BufWriter<File>,
    events_path: PathBuf,
}

impl Journal {
    /// The journal in a run's folder; a resumed run goes on behind the line of its last step.
    ///
    /// # Errors
    /// [`TrainError::Io`], [`TrainError::Running`] where another program has it open.
    pub fn open(folder: &Path, from_step: u64) -> Result<Self, TrainError> {
        let running = || TrainError::Running {
            path: folder.to_owned(),
        };
        if Self::is_open(folder) {
            return Err(running());
        }
        let table_path = folder.join(TABLE);
        let table = open_table(&table_path, from_step).map_err(written(&table_path))?;
        // Some file systems have no locks.
        if matches!(table.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(running());
        }
        let seconds = now();
        let events_path = folder.join(format!(
            "events.out.tfevents.{:010}.{from_step}",
            seconds as u64
        ));
        let file = File::create(&events_path).map_err(written(&events_path))?;
        let mut journal = Self {
            table,
            table_path,
            events: BufWriter::new(file),
            events_path,
        };
        journal.event(Event {
            wall_time: seconds,
            file_version: Some("brain.Event:2".to_owned()),
            ..Event::default()
        })?;
        Ok(journal)
    }

    /// Whether a run in a folder has its journal open.
    #[must_use]
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
            .map_err(written(&self.table_path))?;
        let summary = values.iter().map(|(name, value)| SummaryValue {
            tag: name.clone(),
            simple_value: Some(*value as f32),
            image: None,
        });
        self.summary(step, summary.collect())
    }

    /// Shows a picture, a PNG file of this size.
    ///
    /// # Errors
    /// [`TrainError::Io`].
    pub fn picture(
        &mut self,
        step: u64,
        name: &str,
        (width, height): (usize, usize),
        png: Vec<u8>,
    ) -> Result<(), TrainError> {
        let image = SummaryImage {
            height: height as i32,
            width: width as i32,
            colorspace: 3,
            encoded_image_string: png,
        };
        self.summary(
            step,
            vec![SummaryValue {
                tag: name.to_owned(),
                simple_value: None,
                image: Some(image),
            }],
        )
    }

    fn summary(&mut self, step: u64, value: Vec<SummaryValue>) -> Result<(), TrainError> {
        self.event(Event {
            wall_time: now(),
            step: step as i64,
            file_version: None,
            summary: Some(Summary { value }),
        })
    }

    fn event(&mut self, event: Event) -> Result<(), TrainError> {
        write_record(&mut self.events, &event.encode_to_vec())
            .and_then(|()| self.events.flush())
            .map_err(written(&self.events_path))
    }
}

/// Opens the table without the lines of steps after `from_step`, which a run that is resumed makes again.
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

fn write_record(to: &mut impl Write, data: &[u8]) -> io::Result<()> {
    let length = (data.len() as u64).to_le_bytes();
    to.write_all(&length)?;
    to.write_all(&masked_checksum(&length).to_le_bytes())?;
    to.write_all(data)?;
    to.write_all(&masked_checksum(data).to_le_bytes())
}

fn masked_checksum(data: &[u8]) -> u32 {
    let checksum = CASTAGNOLI.checksum(data);
    checksum.rotate_right(15).wrapping_add(0xa282_ead8)
}

fn now() -> f64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0.0, |time| time.as_secs_f64())
}

fn written(path: &Path) -> impl FnOnce(io::Error) -> TrainError {
    let path = path.to_owned();
    move |source| TrainError::Io {
        path,
        doing: "written",
        source,
    }
}

#[derive(Clone, PartialEq, Message)]
struct Event {
    #[prost(double, tag = "1")]
    wall_time: f64,
    #[prost(int64, tag = "2")]
    step: i64,
    #[prost(string, optional, tag = "3")]
    file_version: Option<String>,
    #[prost(message, optional, tag = "5")]
    summary: Option<Summary>,
}

#[derive(Clone, PartialEq, Message)]
struct Summary {
    #[prost(message, repeated, tag = "1")]
    value: Vec<SummaryValue>,
}

#[derive(Clone, PartialEq, Message)]
struct SummaryValue {
    #[prost(string, tag = "1")]
    tag: String,
    #[prost(float, optional, tag = "2")]
    simple_value: Option<f32>,
    #[prost(message, optional, tag = "4")]
    image: Option<SummaryImage>,
}

#[derive(Clone, PartialEq, Message)]
struct SummaryImage {
    #[prost(int32, tag = "1")]
    height: i32,
    #[prost(int32, tag = "2")]
    width: i32,
    #[prost(int32, tag = "3")]
    colorspace: i32,
    #[prost(bytes = "vec", tag = "4")]
    encoded_image_string: Vec<u8>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_has_the_checksums_that_tensorflow_reads() {
        // The first record of any event file of TensorFlow, but for its time of 0.
        let event = Event {
            file_version: Some("brain.Event:2".to_owned()),
            ..Event::default()
        };
        let mut record = Vec::new();
        write_record(&mut record, &event.encode_to_vec()).unwrap();
        assert_eq!(record[..8], 15_u64.to_le_bytes());
        assert_eq!(&record[12..14], [0x1a, 13]);
        // The check value of CRC-32C, "123456789", masked by its definition.
        assert_eq!(masked_checksum(b"123456789"), 0xc78a_b0e5);
    }

    #[test]
    fn a_resumed_run_does_not_write_its_lines_twice() {
        let folder = tempfile::tempdir().unwrap();
        let values = |loss: f64| BTreeMap::from([("loss".to_owned(), loss)]);
        let mut journal = Journal::open(folder.path(), 0).unwrap();
        for step in 1..=4 {
            journal.scalars(step, &values(step as f64)).unwrap();
        }
        drop(journal);
        let mut journal = Journal::open(folder.path(), 2).unwrap();
        journal.scalars(3, &values(0.5)).unwrap();
        let table = std::fs::read_to_string(folder.path().join(TABLE)).unwrap();
        assert_eq!(table, "step,series,value\n1,loss,1\n2,loss,2\n3,loss,0.5\n");
    }

    #[test]
    fn a_journal_is_open_until_it_is_dropped() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!Journal::is_open(folder.path()));
        let journal = Journal::open(folder.path(), 0).unwrap();
        assert!(Journal::is_open(folder.path()));
        drop(journal);
        assert!(!Journal::is_open(folder.path()));
    }
}
