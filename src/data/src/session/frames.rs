//! The frame index: `frames.jsonl`, one line a frame.

use serde::{Deserialize, Serialize};

use crate::text::unmarked;

/// Whether a table can have an angle, degrees: within some thousands of turns in either direction.
pub fn is_possible_angle(angle: &f64) -> bool {
    (-1e6..=1e6).contains(angle)
}

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

/// All frames of a session, checked: `entries()[i].n == i`, and sequence and time grow.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameIndex {
    entries: Vec<FrameEntry>,
    torn: bool,
}

impl FrameIndex {
    /// Reads an index from the bytes of its file. A last line without line feed that cannot be
    /// parsed was cut off by a power failure: it is skipped, and [`Self::is_truncated`] is true.
    ///
    /// # Errors
    /// The first line that is not a frame's, or does not continue those before it, and what is wrong with it.
    pub fn parse(bytes: &[u8]) -> Result<Self, String> {
        let bytes = unmarked(bytes);
        let (index, fault) = Self::parse_until_fault(bytes);
        // Every line before the first fault is an entry.
        let mut lines = bytes.split_inclusive(|&byte| byte == b'\n');
        let faulty = lines.nth(index.entries.len()).unwrap_or_default();
        let is_truncated =
            !faulty.ends_with(b"\n") && serde_json::from_slice::<FrameEntry>(faulty).is_err();
        match fault {
            Some(fault) if !is_truncated => Err(fault),
            _ => Ok(index),
        }
    }

    /// Reads an index up to the first fault, and returns that fault too: after a power cut the end of
    /// the file can hold anything.
    pub fn parse_until_fault(bytes: &[u8]) -> (Self, Option<String>) {
        let mut index = Self::default();
        for text in unmarked(bytes).split_inclusive(|&byte| byte == b'\n') {
            let read = match serde_json::from_slice::<FrameEntry>(text) {
                Ok(entry) => index.push(entry),
                Err(error) => Err(index.fault(&format!("is not a frame's entry ({error})"))),
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
            entry.angle_deg = found.filter(is_possible_angle);
            any |= entry.angle_deg.is_some();
        }
        any
    }

    /// Adds the next frame.
    ///
    /// # Errors
    /// Why the entry does not continue the index, which is then unchanged.
    pub fn push(&mut self, entry: FrameEntry) -> Result<(), String> {
        let (n, sequence, t_us) = (entry.n, entry.sequence, entry.t_us);
        let expected = self.entries.len() as u64;
        let last = self.entries.last();
        let what = if n != expected {
            format!("says n = {n}, but {expected} was expected")
        } else if !entry.angle_deg.as_ref().is_none_or(is_possible_angle) {
            "has an angle that no turntable reaches".to_owned()
        } else if let Some(last) = last.filter(|last| sequence <= last.sequence) {
            let previous = last.sequence;
            format!("repeats or goes back in the driver's sequence ({sequence} after {previous})")
        } else if let Some(last) = last.filter(|last| t_us <= last.t_us) {
            let previous = last.t_us;
            format!("is not later than the line before ({t_us} us after {previous} us)")
        } else {
            self.entries.push(entry);
            return Ok(());
        };
        Err(self.fault(&what))
    }

    /// What is wrong with the line after those that were read.
    fn fault(&self, what: &str) -> String {
        format!("line {} {what}", self.entries.len() + 1)
    }

    /// The frames, in order.
    pub fn entries(&self) -> &[FrameEntry] {
        &self.entries
    }

    /// True if the file's last line was cut off.
    pub fn is_truncated(&self) -> bool {
        self.torn
    }

    /// The jumps of the driver's counter, in order.
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
        assert!(!index.is_truncated());
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
        assert!(index.is_truncated());
    }

    #[test]
    fn an_index_that_an_editor_saved_is_the_same() {
        let whole = text(&[entry(0), entry(1)]);
        let saved = format!("\u{feff}{}", whole.replace('\n', "\r\n"));
        let index = FrameIndex::parse(saved.as_bytes()).unwrap();
        assert_eq!(index.entries().len(), 2);
        assert!(!index.is_truncated());
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
        let fault = fault.unwrap();
        assert!(fault.contains("line 3 "), "{fault}");
    }

    #[test]
    fn a_broken_line_in_the_middle_is_named() {
        let broken = text(&[entry(0)]) + "{\"n\":\n" + &text(&[entry(1)]);
        let fault = FrameIndex::parse(broken.as_bytes()).unwrap_err();
        assert!(fault.contains("line 2 "), "{fault}");
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
            (skipped, "n = 2"),
            (early, "0 us after 0 us"),
            (repeated, "sequence (0 after 0)"),
        ] {
            let read = FrameIndex::parse(text(&[entry(0), second]).as_bytes());
            let fault = read.unwrap_err().to_string();
            assert!(
                fault.contains("line 2 ") && fault.contains(wanted),
                "{fault}"
            );
        }
    }
}
