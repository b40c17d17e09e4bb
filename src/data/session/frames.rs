//! The frame index: `frames.jsonl`, one line a frame.

use serde::{Deserialize, Serialize};

use crate::text::unmarked;

/// Largest plausible angle, degrees: some thousands of turns in either direction.
const MOST_DEGREES: f64 = 1e6;

/// One frame as it was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct FrameEntry {
    /// Position in the video, 0-based.
    pub n: u64,
    /// The driver's frame counter; a gap means dropped frames.
    pub sequence: u64,
    /// The driver's monotonic time stamp, microseconds.
    pub t_us: i64,
    /// Interpolated angle of the table, degrees; `None` without a table.
    pub angle_deg: Option<f64>,
}

/// Frames that the driver counted and that are missing in the video.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Gap {
    /// Position in the video of the frame after the gap.
    pub before: u64,
    /// How many frames are missing there.
    pub missing: u64,
}

/// What is wrong in a frame index.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IndexFault {
    /// A line is not a frame's.
    #[error("line {line} is not a frame's entry ({what})")]
    Line {
        /// 1-based line.
        line: u64,
        /// The parser's message.
        what: String,
    },
    /// Positions do not count up from 0.
    #[error("line {line} says n = {found}, but {expected} was expected")]
    Position {
        /// 1-based line.
        line: u64,
        /// The expected position.
        expected: u64,
        /// The position in the file.
        found: u64,
    },
    /// The driver's counter did not grow.
    #[error("line {line} repeats or goes back in the driver's sequence ({found} after {previous})")]
    Sequence {
        /// 1-based line.
        line: u64,
        /// The counter in the line before.
        previous: u64,
        /// The counter in this line.
        found: u64,
    },
    /// Time did not grow.
    #[error("line {line} is not later than the line before ({found} us after {previous} us)")]
    Time {
        /// 1-based line.
        line: u64,
        /// The time stamp in the line before, microseconds.
        previous: i64,
        /// The time stamp in this line, microseconds.
        found: i64,
    },
    /// The angle is not finite, or implausibly large.
    #[error("line {line} has an angle that no turntable reaches")]
    Angle {
        /// 1-based line.
        line: u64,
    },
}

/// All frames of a session, checked: `entries()[i].n == i`, and sequence and time grow.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameIndex {
    entries: Vec<FrameEntry>,
    torn: bool,
}

impl FrameIndex {
    /// Reads an index from the bytes of its file. A last line without line feed that cannot be
    /// parsed was cut off by a power failure: it is skipped, and [`Self::is_torn`] is true.
    ///
    /// # Errors
    /// [`IndexFault`] with the first line that is wrong.
    pub fn parse(bytes: &[u8]) -> Result<Self, IndexFault> {
        let mut index = Self::default();
        let mut lines = unmarked(bytes)
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

    /// Reads an index up to the first fault, and returns that fault too: after a power cut the end of
    /// the file can hold anything.
    #[must_use]
    pub fn parse_until_fault(bytes: &[u8]) -> (Self, Option<IndexFault>) {
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
    /// If an entry cannot be serialized, which does not happen to a checked one.
    pub fn to_jsonl(&self) -> Result<Vec<u8>, serde_json::Error> {
        let mut bytes = Vec::with_capacity(self.entries.len() * 72);
        for entry in &self.entries {
            serde_json::to_writer(&mut bytes, entry)?;
            bytes.push(b'\n');
        }
        Ok(bytes)
    }

    /// Removes all frames from position `frames` on.
    pub fn truncate(&mut self, frames: usize) {
        self.entries.truncate(frames);
    }

    /// Gives frames without angle the one (degrees) that `angle` returns for their time stamp
    /// (microseconds); returns whether any got one. Angles that no turntable reaches are left out.
    pub fn add_angles(&mut self, angle: &dyn Fn(i64) -> Option<f64>) -> bool {
        let mut any = false;
        for entry in self
            .entries
            .iter_mut()
            .filter(|entry| entry.angle_deg.is_none())
        {
            let found = angle(entry.t_us);
            entry.angle_deg = found.filter(|angle| (-MOST_DEGREES..=MOST_DEGREES).contains(angle));
            any |= entry.angle_deg.is_some();
        }
        any
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// [`IndexFault`] if the entry does not continue the index, which is then unchanged.
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

    /// True if the file's last line was cut off.
    #[must_use]
    pub fn is_torn(&self) -> bool {
        self.torn
    }

    /// The jumps of the driver's counter, in order.
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
    fn a_last_line_that_was_cut_off_is_skipped_and_reported() {
        let whole = text(&[entry(0), entry(1)]);
        let index = FrameIndex::parse(&whole.as_bytes()[..whole.len() - 9]).unwrap();
        assert_eq!(index.entries().len(), 1);
        assert!(index.is_torn());
    }

    #[test]
    fn an_index_that_an_editor_saved_is_the_same() {
        let whole = text(&[entry(0), entry(1)]);
        let saved = format!("\u{feff}{}", whole.replace('\n', "\r\n"));
        let index = FrameIndex::parse(saved.as_bytes()).unwrap();
        assert_eq!(index.entries().len(), 2);
        assert!(!index.is_torn());
    }

    #[test]
    fn an_index_is_read_up_to_its_first_fault() {
        let whole = text(&[entry(0), entry(1)]);
        let (index, fault) = FrameIndex::parse_until_fault(whole.as_bytes());
        assert_eq!((index.entries().len(), fault), (2, None));
        assert_eq!(index.to_jsonl().unwrap(), whole.as_bytes());
        let zeros = [whole.as_bytes(), &[0; 100]].concat();
        let (index, fault) = FrameIndex::parse_until_fault(&zeros);
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
