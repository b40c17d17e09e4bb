//! Bytes to lines: comments, spaces, letter case, checksums and what went wrong on the way.
//!
//! Knows nothing of what a line means.

use crate::crc::Crc;

/// Characters that a line may have without spaces and comments.
pub(crate) const CAPACITY: usize = 96;

/// What the end of a line says about the rest of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Checksum {
    /// There is none.
    Absent,
    /// It is right.
    Right,
    /// It is wrong, or no checksum.
    Wrong,
}

/// A line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Line<'a> {
    /// Upper case, without spaces, comments and checksum.
    pub text: &'a [u8],
    /// How its checksum was.
    pub checksum: Checksum,
    /// Characters were left out because the buffer was full.
    pub too_long: bool,
    /// Bytes of it, or of its surroundings, were lost.
    pub damaged: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Text,
    Bracket,
    Semicolon,
    /// After `*`: so many digits, of this value.
    Sum {
        digits: u8,
        value: u16,
    },
    /// After `*`, something else than four digits.
    NoSum,
}

/// How far lost bytes reach. The byte was lost behind those that were waiting to be read, so all
/// of these are suspect, and the line after them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Loss {
    None,
    /// Bytes from before the loss may be waiting still.
    Ahead,
    /// It lies in the line that is being read.
    Here,
}

/// Gathers a line. The text comes last: small fields are cheap to reach near the start.
#[derive(Debug)]
#[repr(C)]
pub(crate) struct LineReader {
    length: u8,
    part: Part,
    crc: Crc,
    too_long: bool,
    loss: Loss,
    after_return: bool,
    complete: bool,
    text: [u8; CAPACITY],
}

impl LineReader {
    /// A reader with nothing read.
    pub(crate) const fn new() -> LineReader {
        LineReader {
            text: [0; CAPACITY],
            length: 0,
            part: Part::Text,
            crc: Crc::new(),
            too_long: false,
            loss: Loss::None,
            after_return: false,
            complete: false,
        }
    }

    /// Forgets everything that was read.
    pub(crate) fn reset(&mut self) {
        *self = LineReader::new();
    }

    /// Takes in a byte. True: the line is complete; [`LineReader::line`] tells it until the next
    /// byte comes.
    pub(crate) fn push(&mut self, byte: u8) -> bool {
        if core::mem::take(&mut self.complete) {
            self.begin();
        }
        let after_return = core::mem::replace(&mut self.after_return, byte == b'\r');
        match byte {
            b'\n' if after_return => return false,
            b'\r' | b'\n' => {
                self.complete = true;
                return true;
            }
            _ => {}
        }
        match self.part {
            Part::Sum { digits, value } => self.part = sum_digit(digits, value, byte),
            Part::NoSum => {}
            Part::Text if byte == b'*' => {
                self.part = Part::Sum {
                    digits: 0,
                    value: 0,
                }
            }
            _ => {
                self.crc.update(byte);
                self.take(byte);
            }
        }
        false
    }

    fn take(&mut self, byte: u8) {
        match (self.part, byte) {
            (Part::Bracket, b')') => self.part = Part::Text,
            (Part::Text, b'(') => self.part = Part::Bracket,
            (Part::Text, b';') => self.part = Part::Semicolon,
            (Part::Text, b'!'..) if byte != b'/' => {
                match self.text.get_mut(usize::from(self.length)) {
                    Some(place) => {
                        *place = byte.to_ascii_uppercase();
                        self.length += 1;
                    }
                    None => self.too_long = true,
                }
            }
            _ => {}
        }
    }

    fn begin(&mut self) {
        self.length = 0;
        self.part = Part::Text;
        self.crc = Crc::new();
        self.too_long = false;
        if self.loss == Loss::Here {
            self.loss = Loss::None;
        }
    }

    /// The line that [`LineReader::push`] completed.
    pub(crate) fn line(&self) -> Line<'_> {
        Line {
            text: self.text.get(..usize::from(self.length)).unwrap_or(&[]),
            checksum: match self.part {
                Part::Text | Part::Bracket | Part::Semicolon => Checksum::Absent,
                Part::Sum { digits: 4, value } if value == self.crc.value() => Checksum::Right,
                Part::Sum { .. } | Part::NoSum => Checksum::Wrong,
            },
            too_long: self.too_long,
            damaged: self.loss != Loss::None,
        }
    }

    /// Bytes were lost on the way.
    pub(crate) fn lose(&mut self) {
        self.loss = Loss::Ahead;
    }

    /// All bytes that had come were read.
    pub(crate) fn drained(&mut self) {
        if self.loss == Loss::Ahead {
            if core::mem::take(&mut self.complete) {
                self.begin();
            }
            self.loss = Loss::Here;
        }
    }
}

fn sum_digit(digits: u8, value: u16, byte: u8) -> Part {
    let digit = match byte {
        b'0'..=b'9' => byte - b'0',
        b'A'..=b'F' => byte - b'A' + 10,
        _ => return Part::NoSum,
    };
    if digits >= 4 {
        return Part::NoSum;
    }
    Part::Sum {
        digits: digits + 1,
        value: (value << 4) | u16::from(digit),
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;

    /// The lines of some text: content, checksum, too long, damaged.
    fn check(reader: &mut LineReader, text: &str, expected: &[(&str, Checksum, bool, bool)]) {
        let mut expected = expected.iter();
        for byte in text.bytes() {
            if reader.push(byte) {
                let line = reader.line();
                let content = core::str::from_utf8(line.text).unwrap();
                let got = (content, line.checksum, line.too_long, line.damaged);
                assert_eq!(Some(&got), expected.next(), "{text:?}");
            }
        }
        assert_eq!(expected.next(), None, "{text:?}");
    }

    fn plain(text: &str) -> (&str, Checksum, bool, bool) {
        (text, Checksum::Absent, false, false)
    }

    #[test]
    fn every_kind_of_line_end_ends_one_line() {
        let mut reader = LineReader::new();
        let lines = [plain("A"), plain("B"), plain("C"), plain(""), plain("")];
        check(&mut reader, "A\rB\nC\r\n\r\r\n", &lines);
    }

    #[test]
    fn spaces_and_comments_go_and_letters_grow() {
        let mut reader = LineReader::new();
        let lines = [plain("G1X-1.5F3"), plain("$H")];
        check(&mut reader, "g1 (a * b) x-1.5\tf 3 ; *\n/$h\n", &lines);
        check(
            &mut reader,
            "G(open; *1234\nG4\n",
            &[plain("G"), plain("G4")],
        );
    }

    #[test]
    fn a_checksum_covers_the_bytes_as_they_came() {
        let mut reader = LineReader::new();
        let right = [("123456789", Checksum::Right, false, false)];
        check(&mut reader, "123456789*29B1\n", &right);
        let wrong = |text| [(text, Checksum::Wrong, false, false)];
        for line in ["123456789*29B2\n", "123456789*29b1\n", "123456789*29B\n"] {
            check(&mut reader, line, &wrong("123456789"));
        }
        check(&mut reader, "12345 6789*29B1\n", &wrong("123456789"));
        check(&mut reader, "123456789*29B10\n", &wrong("123456789"));
        check(&mut reader, "123456789*29B1*29B1\n", &wrong("123456789"));
    }

    #[test]
    fn a_long_line_is_told_and_the_next_one_is_whole() {
        let mut reader = LineReader::new();
        let long = "X".repeat(CAPACITY + 1) + "\nG0\n";
        let cut = "X".repeat(CAPACITY);
        let lines = [(cut.as_str(), Checksum::Absent, true, false), plain("G0")];
        check(&mut reader, &long, &lines);
    }

    #[test]
    fn a_loss_marks_what_was_waiting_and_one_line_more() {
        let mut reader = LineReader::new();
        let bad = |text| (text, Checksum::Absent, false, true);
        check(&mut reader, "G1", &[]);
        reader.lose();
        check(&mut reader, "X1\nG2\nG", &[bad("G1X1"), bad("G2")]);
        reader.drained();
        check(&mut reader, "3\nG4\n", &[bad("G3"), plain("G4")]);
    }

    #[test]
    fn a_loss_between_lines_marks_the_next_one() {
        let mut reader = LineReader::new();
        check(&mut reader, "G1\n", &[plain("G1")]);
        reader.lose();
        reader.drained();
        check(
            &mut reader,
            "X5\nG4\n",
            &[("X5", Checksum::Absent, false, true), plain("G4")],
        );
    }
}
