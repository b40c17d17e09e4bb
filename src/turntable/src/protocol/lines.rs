//! Assembles lines from bytes, each with the arrival time of its first byte.

/// Longest accepted line, bytes: a report of grblHAL with six axes and all its fields is shorter.
const MAX_LENGTH: usize = 512;

/// The result of a line end.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum ReceivedLine {
    /// A line, without its line end.
    Line {
        /// Its text.
        text: String,
        /// Arrival time of its first byte, microseconds.
        first_us: i64,
    },
    /// Not a line: it has bytes outside printable ASCII, or is too long.
    Noise,
}

/// Assembles lines.
#[derive(Debug, Default)]
pub(super) struct LineReader {
    bytes: Vec<u8>,
    first_us: i64,
    is_noise: bool,
}

impl LineReader {
    /// Takes one byte that arrived at `now_us`; a line end returns what stands before it.
    pub(super) fn push(&mut self, now_us: i64, byte: u8) -> Option<ReceivedLine> {
        if byte == b'\r' || byte == b'\n' {
            return self.end();
        }
        if self.bytes.is_empty() && !self.is_noise {
            self.first_us = now_us;
        }
        if !(b' '..=b'~').contains(&byte) || self.bytes.len() == MAX_LENGTH {
            self.is_noise = true;
        } else {
            self.bytes.push(byte);
        }
        None
    }

    fn end(&mut self) -> Option<ReceivedLine> {
        let bytes = std::mem::take(&mut self.bytes);
        if std::mem::take(&mut self.is_noise) {
            return Some(ReceivedLine::Noise);
        }
        if bytes.is_empty() {
            return None;
        }
        Some(match String::from_utf8(bytes) {
            Ok(text) => ReceivedLine::Line {
                text,
                first_us: self.first_us,
            },
            Err(_) => ReceivedLine::Noise,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(reader: &mut LineReader, now_us: i64, bytes: &[u8]) -> Vec<ReceivedLine> {
        let pieces = bytes.iter().filter_map(|&byte| reader.push(now_us, byte));
        pieces.collect()
    }

    #[test]
    fn a_line_has_the_time_of_its_first_byte() {
        let mut reader = LineReader::default();
        assert_eq!(read(&mut reader, 5, b"\r\no"), []);
        let text = "ok".to_owned();
        let line = ReceivedLine::Line { text, first_us: 5 };
        assert_eq!(read(&mut reader, 9, b"k\r\n"), [line]);
    }

    #[test]
    fn a_line_with_foreign_bytes_or_without_end_is_noise_as_a_whole() {
        let mut reader = LineReader::default();
        assert_eq!(read(&mut reader, 0, b"o\xffk\r\n"), [ReceivedLine::Noise]);
        assert_eq!(read(&mut reader, 0, &[b'x'; MAX_LENGTH + 1]), []);
        assert_eq!(read(&mut reader, 0, b"\n\n"), [ReceivedLine::Noise]);
    }
}
