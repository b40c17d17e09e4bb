//! Checked lines: a sequence number and a checksum around a line, so that a damaged, lost or
//! repeated line never moves the table.
//!
//! Knows lines and their answers; nothing of what a line means.

use crate::error::Error;
use crate::line::{Checksum, Line};
use crate::number;

/// How a line was answered; 0 is `ok`.
pub(crate) type Answer = u8;

/// A checked session with the host, once it has opened one.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Session {
    /// Lines are plain.
    #[default]
    Closed,
    /// Lines are checked; the last one had this number and this answer.
    Open {
        /// The number of the last line that was taken.
        last: u32,
        /// How that was answered.
        answer: Answer,
    },
}

/// What to do with a line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum CheckedLine<'a> {
    /// Do what it says. Its answer names the sequence number, if there is one.
    Execute {
        /// The sequence number, in a session.
        sequence: Option<u32>,
        /// The line without number and checksum.
        block: &'a [u8],
    },
    /// Answer, and do nothing.
    Answer {
        /// The sequence number that the answer names.
        sequence: Option<u32>,
        /// The answer.
        answer: Answer,
    },
}

impl Session {
    /// Whether a session is open, in which every line that is sent carries a checksum.
    pub(crate) fn is_open(&self) -> bool {
        matches!(self, Session::Open { .. })
    }

    /// Judges a line; opens the session where the line asks for it.
    pub(crate) fn judge<'a>(&mut self, line: &Line<'a>) -> CheckedLine<'a> {
        let refuse = |sequence, error: Error| CheckedLine::Answer {
            sequence,
            answer: error.code(),
        };
        let checked = match line.checksum {
            Checksum::Right => split(line.text),
            Checksum::Absent | Checksum::Wrong => None,
        };
        if line.damaged && checked.is_none() {
            return refuse(None, Error::Damaged);
        }
        let Some((sequence, block)) = checked else {
            return match (line.checksum, &self) {
                (Checksum::Absent, Session::Closed) if line.too_long => {
                    refuse(None, Error::LineTooLong)
                }
                (Checksum::Absent, Session::Closed) => CheckedLine::Execute {
                    sequence: None,
                    block: line.text,
                },
                _ => refuse(None, Error::Damaged),
            };
        };
        if sequence == 0 && block.is_empty() && !line.too_long {
            *self = Session::Open { last: 0, answer: 0 };
            return CheckedLine::Answer {
                sequence: Some(0),
                answer: 0,
            };
        }
        let Session::Open { last, answer } = *self else {
            return refuse(Some(sequence), Error::NoSession);
        };
        let sequence = Some(sequence);
        if sequence == Some(last) {
            CheckedLine::Answer { sequence, answer }
        } else if sequence != last.checked_add(1) {
            refuse(sequence, Error::OutOfOrder)
        } else if line.too_long {
            self.remember(sequence, Error::LineTooLong.code());
            refuse(sequence, Error::LineTooLong)
        } else {
            CheckedLine::Execute { sequence, block }
        }
    }

    /// Keeps the answer to a line that was executed.
    pub(crate) fn remember(&mut self, sequence: Option<u32>, answer: Answer) {
        if let (Session::Open { .. }, Some(last)) = (&self, sequence) {
            *self = Session::Open { last, answer };
        }
    }
}

/// `N<sequence>` and the block behind it.
fn split(text: &[u8]) -> Option<(u32, &[u8])> {
    match text {
        [b'N', digits @ ..] => number::digits(digits, 7),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The highest sequence number: it has seven digits.
    const MAX_SEQUENCE: u32 = 9_999_999;

    fn line(text: &str, checksum: Checksum) -> Line<'_> {
        Line {
            text: text.as_bytes(),
            checksum,
            too_long: false,
            damaged: false,
        }
    }

    fn right(text: &str) -> Line<'_> {
        line(text, Checksum::Right)
    }

    fn answer(sequence: Option<u32>, answer: Answer) -> CheckedLine<'static> {
        CheckedLine::Answer { sequence, answer }
    }

    #[test]
    fn outside_a_session_lines_are_plain_and_checked_ones_are_refused() {
        let mut session = Session::default();
        let plain = CheckedLine::Execute {
            sequence: None,
            block: b"N5G0",
        };
        assert_eq!(session.judge(&line("N5G0", Checksum::Absent)), plain);
        assert_eq!(session.judge(&right("N5G0")), answer(Some(5), 72));
        assert_eq!(session.judge(&right("N0G0")), answer(Some(0), 72));
        assert_eq!(session.judge(&right("G0")), answer(None, 70));
        assert_eq!(
            session.judge(&line("N0", Checksum::Wrong)),
            answer(None, 70)
        );
        assert_eq!(session, Session::Closed);
    }

    #[test]
    fn in_a_session_only_the_line_that_is_due_is_executed() {
        let mut session = Session::default();
        assert_eq!(session.judge(&right("N0")), answer(Some(0), 0));
        let due = CheckedLine::Execute {
            sequence: Some(1),
            block: b"G1X5",
        };
        assert_eq!(session.judge(&right("N1G1X5")), due);
        session.remember(Some(1), 22);
        assert_eq!(session.judge(&right("N1G1X5")), answer(Some(1), 22));
        assert_eq!(session.judge(&right("N3G0")), answer(Some(3), 71));
        assert_eq!(session.judge(&right("N0G0")), answer(Some(0), 71));
        for damaged in ["N2G0", "G0", ""] {
            let lost = line(damaged, Checksum::Absent);
            assert_eq!(session.judge(&lost), answer(None, 70));
            let wrong = line(damaged, Checksum::Wrong);
            assert_eq!(session.judge(&wrong), answer(None, 70));
        }
        assert_eq!(session.judge(&right("N0")), answer(Some(0), 0));
        assert_eq!(session, Session::Open { last: 0, answer: 0 });
    }

    #[test]
    fn numbers_end_at_seven_digits() {
        let mut session = Session::Open {
            last: MAX_SEQUENCE - 1,
            answer: 0,
        };
        let due = CheckedLine::Execute {
            sequence: Some(MAX_SEQUENCE),
            block: b"",
        };
        assert_eq!(session.judge(&right("N9999999")), due);
        session.remember(Some(MAX_SEQUENCE), 0);
        assert_eq!(session.judge(&right("N10000000")), answer(None, 70));
        assert_eq!(session.judge(&right("N")), answer(None, 70));
    }

    #[test]
    fn a_long_checked_line_is_refused_by_its_number_and_remembered() {
        let mut session = Session::Open { last: 4, answer: 0 };
        let long = Line {
            too_long: true,
            ..right("N5G1")
        };
        assert_eq!(session.judge(&long), answer(Some(5), 11));
        assert_eq!(session.judge(&right("N5G1")), answer(Some(5), 11));
    }
}
