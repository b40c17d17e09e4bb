//! The frame index: `frames.jsonl`, one line a frame.

use serde::{Deserialize, Serialize};

/// Largest angle that is believed, degrees: some thousands of turns either way.
const MOST_DEGREES: f64 = 1e6;

/// One frame, as the recorder knew it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrameEntry {
    /// Position in the video, 0-based.
    pub n: u64,
    /// The driver's counter: a gap is a dropped frame.
    pub sequence: u64,
    /// The driver's monotonic time stamp, microseconds.
    pub t_us: i64,
    /// Interpolated angle of the table, degrees; `None` where there is no table.
    pub angle_deg: Option<f64>,
}

/// Frames that the driver counted and the video lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// Position in the video of the frame after the gap.
    pub before: u64,
    /// How many frames are missing there.
    pub missing: u64,
}

/// What is wrong in a frame index.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum IndexFault {
    /// A line is not a frame's.
    #[error("line {line} is not a frame's entry ({what})")]
    Line {
        /// 1-based line.
        line: u64,
        /// The parser's words.
        what: String,
    },
    /// Positions do not count up from 0.
    #[error("line {line} says n = {found} where {expected} is due")]
    Position {
        /// 1-based line.
        line: u64,
        /// The number that is due.
        expected: u64,
        /// What stands there.
        found: u64,
    },
    /// The driver's counter did not grow.
    #[error("line {line} repeats or goes back in the driver's sequence ({found} after {previous})")]
    Sequence {
        /// 1-based line.
        line: u64,
        /// The counter of the line before.
        previous: u64,
        /// What stands there.
        found: u64,
    },
    /// Time did not grow.
    #[error(
        "line {line} does not come later than the line before ({found} us after {previous} us)"
    )]
    Time {
        /// 1-based line.
        line: u64,
        /// The time stamp of the line before, microseconds.
        previous: i64,
        /// What stands there.
        found: i64,
    },
    /// The angle cannot be one.
    #[error("line {line} has an angle that no table reaches")]
    Angle {
        /// 1-based line.
        line: u64,
    },
}

/// All frames of a session, in order, checked: `entries()[i].n == i`, sequence and time grow.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameIndex {
    entries: Vec<FrameEntry>,
    torn: bool,
}

impl FrameIndex {
    /// Reads an index from the bytes of its file. A last line without line feed that cannot be
    /// read is what a power cut leaves: it is passed over, and [`Self::is_torn`] tells.
    ///
    /// # Errors
    /// [`IndexFault`] names the first line that is wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, IndexFault> {
        let mut index = Self::default();
        let mut lines = bytes
            .split_inclusive(|&byte| byte == b'\n')
            .zip(1_u64..)
            .peekable();
        while let Some((text, line)) = lines.next() {
            let ended = text.ends_with(b"\n");
            match serde_json::from_slice::<FrameEntry>(text) {
                Ok(entry) => index.push_as(entry, line)?,
                Err(_) if !ended && lines.peek().is_none() => index.torn = true,
                Err(error) => {
                    return Err(IndexFault::Line {
                        line,
                        what: error.to_string(),
                    });
                }
            }
        }
        Ok(index)
    }

    /// Reads an index as far as it is whole, and says what is wrong from there on: what a power cut
    /// leaves need not be a line.
    #[must_use]
    pub fn parse_as_far_as_whole(bytes: &[u8]) -> (Self, Option<IndexFault>) {
        let mut index = Self::default();
        for (text, line) in bytes.split_inclusive(|&byte| byte == b'\n').zip(1_u64..) {
            let read = match serde_json::from_slice::<FrameEntry>(text) {
                Ok(entry) => index.push_as(entry, line),
                Err(error) => Err(IndexFault::Line {
                    line,
                    what: error.to_string(),
                }),
            };
            if let Err(fault) = read {
                index.torn = true;
                return (index, Some(fault));
            }
        }
        (index, None)
    }

    /// The index as the bytes of its file.
    ///
    /// # Errors
    /// Where an entry is not JSON, which no checked one is.
    pub fn to_jsonl(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut bytes = Vec::with_capacity(self.entries.len() * 72);
        for entry in &self.entries {
            serde_json::to_writer(&mut bytes, entry)?;
            bytes.push(b'\n');
        }
        Ok(bytes)
    }

    /// Forgets all frames from position `frames` on.
    pub fn truncate(&mut self, frames: usize) {
        self.entries.truncate(frames);
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// [`IndexFault`] where the entry does not continue the index; the index stays as it was.
    pub fn push(&mut self, entry: FrameEntry) -> Result<(), IndexFault> {
        self.push_as(entry, self.entries.len() as u64 + 1)
    }

    fn push_as(&mut self, entry: FrameEntry, line: u64) -> Result<(), IndexFault> {
        let expected = self.entries.len() as u64;
        if entry.n != expected {
            return Err(IndexFault::Position {
                line,
                expected,
                found: entry.n,
            });
        }
        if entry
            .angle_deg
            .is_some_and(|angle| !(-MOST_DEGREES..=MOST_DEGREES).contains(&angle))
        {
            return Err(IndexFault::Angle { line });
        }
        if let Some(last) = self.entries.last() {
            if entry.sequence <= last.sequence {
                let (previous, found) = (last.sequence, entry.sequence);
                return Err(IndexFault::Sequence {
                    line,
                    previous,
                    found,
                });
            }
            if entry.t_us <= last.t_us {
                return Err(IndexFault::Time {
                    line,
                    previous: last.t_us,
                    found: entry.t_us,
                });
            }
        }
        self.entries.push(entry);
        Ok(())
    }

    /// The frames, in order.
    #[must_use]
    pub fn entries(&self) -> &[FrameEntry] {
        &self.entries
    }

    /// True where the file's last line was cut in the middle.
    #[must_use]
    pub fn is_torn(&self) -> bool {
        self.torn
    }

    /// Where the driver's counter jumps, in order.
    #[must_use]
    pub fn gaps(&self) -> Vec<Gap> {
        let pairs = self.entries.windows(2);
        pairs
            .filter_map(|pair| {
                let missing = pair[1].sequence - pair[0].sequence - 1;
                (missing > 0).then_some(Gap {
                    before: pair[1].n,
                    missing,
                })
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entry(n: u64) -> FrameEntry {
        FrameEntry {
            n,
            sequence: n,
            t_us: n as i64 * 33_333,
            angle_deg: Some(n as f64 * 0.24),
        }
    }

    fn text(entries: &[FrameEntry]) -> String {
        entries
            .iter()
            .map(|e| serde_json::to_string(e).unwrap() + "\n")
            .collect()
    }

    #[test]
    fn an_index_is_read_as_it_was_written() {
        let entries: Vec<_> = (0..5).map(entry).collect();
        let index = FrameIndex::parse(text(&entries).as_bytes()).unwrap();
        assert_eq!(index.entries(), entries);
        assert!(!index.is_torn());
        assert!(index.gaps().is_empty());
    }

    #[test]
    fn a_gap_in_the_sequence_is_reported_at_its_frame() {
        let mut entries: Vec<_> = (0..6).map(entry).collect();
        for entry in &mut entries[3..] {
            entry.sequence += 2;
        }
        let index = FrameIndex::parse(text(&entries).as_bytes()).unwrap();
        assert_eq!(
            index.gaps(),
            [Gap {
                before: 3,
                missing: 2
            }]
        );
    }

    #[test]
    fn a_last_line_cut_by_a_power_cut_is_passed_over_and_told() {
        let whole = text(&[entry(0), entry(1)]);
        let index = FrameIndex::parse(&whole.as_bytes()[..whole.len() - 9]).unwrap();
        assert_eq!(index.entries().len(), 1);
        assert!(index.is_torn());
    }

    #[test]
    fn an_index_is_read_as_far_as_it_is_whole() {
        let whole = text(&[entry(0), entry(1)]);
        let (index, fault) = FrameIndex::parse_as_far_as_whole(whole.as_bytes());
        assert_eq!((index.entries().len(), fault), (2, None));
        assert_eq!(index.to_jsonl().unwrap(), whole.as_bytes());
        let zeros = [whole.as_bytes(), &[0; 100]].concat();
        let (index, fault) = FrameIndex::parse_as_far_as_whole(&zeros);
        assert_eq!(index.entries().len(), 2);
        assert!(matches!(fault, Some(IndexFault::Line { line: 3, .. })));
    }

    #[test]
    fn a_broken_line_in_the_middle_is_named() {
        let broken = text(&[entry(0)]) + "{\"n\":\n" + &text(&[entry(1)]);
        let fault = FrameIndex::parse(broken.as_bytes()).unwrap_err();
        assert!(matches!(fault, IndexFault::Line { line: 2, .. }), "{fault}");
    }

    #[test]
    fn positions_time_and_sequence_must_grow() {
        let mut skipped = entry(1);
        skipped.n = 2;
        let mut early = entry(1);
        early.t_us = 0;
        let mut repeated = entry(1);
        repeated.sequence = 0;
        for (second, wanted) in [
            (
                skipped,
                IndexFault::Position {
                    line: 2,
                    expected: 1,
                    found: 2,
                },
            ),
            (
                early,
                IndexFault::Time {
                    line: 2,
                    previous: 0,
                    found: 0,
                },
            ),
            (
                repeated,
                IndexFault::Sequence {
                    line: 2,
                    previous: 0,
                    found: 0,
                },
            ),
        ] {
            assert_eq!(
                FrameIndex::parse(text(&[entry(0), second]).as_bytes()),
                Err(wanted)
            );
        }
    }
}
