//! Text as programs write it: with a byte order mark or without, in UTF-8, UTF-16 or Latin-1, with the ends of lines of any
//! system.

use std::borrow::Cow;

/// The text of a file. A line that is not UTF-8 is read as Latin-1, which always succeeds.
pub(super) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    match bytes {
        [0xEF, 0xBB, 0xBF, rest @ ..] => utf8_or_latin1(rest),
        [0xFF, 0xFE, rest @ ..] => utf16(rest, u16::from_le_bytes).into(),
        [0xFE, 0xFF, rest @ ..] => utf16(rest, u16::from_be_bytes).into(),
        _ => utf8_or_latin1(bytes),
    }
}

fn utf8_or_latin1(bytes: &[u8]) -> Cow<'_, str> {
    if let Ok(text) = str::from_utf8(bytes) {
        return text.into();
    }
    let mut text = String::with_capacity(bytes.len() + bytes.len() / 8);
    for line in bytes.split_inclusive(|&byte| byte == b'\n') {
        match str::from_utf8(line) {
            Ok(line) => text.push_str(line),
            Err(_) => text.extend(line.iter().map(|&byte| char::from(byte))),
        }
    }
    text.into()
}

fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> String {
    let (units, _) = bytes.as_chunks();
    let units: Vec<u16> = units.iter().map(|&pair| unit(pair)).collect();
    String::from_utf16_lossy(&units)
}

/// The statements of a Wavefront file, each with the number of its first line, counted from 1: a line that ends in a
/// backslash goes on in the next one.
pub(super) struct Statements<'a> {
    rest: &'a str,
    lines: usize,
}

impl<'a> Statements<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self {
            rest: text,
            lines: 0,
        }
    }

    fn line(&mut self) -> Option<&'a str> {
        if self.rest.is_empty() {
            return None;
        }
        self.lines += 1;
        let end = self.rest.find(['\n', '\r']).unwrap_or(self.rest.len());
        let (line, rest) = self.rest.split_at(end);
        let rest = rest.strip_prefix("\r\n").or_else(|| rest.get(1..));
        self.rest = rest.unwrap_or_default();
        Some(line)
    }
}

impl<'a> Iterator for Statements<'a> {
    type Item = (usize, Cow<'a, str>);

    fn next(&mut self) -> Option<Self::Item> {
        let first = self.line()?;
        let number = self.lines;
        let Some(part) = continued(first) else {
            return Some((number, first.into()));
        };
        let mut whole = part.to_owned();
        while let Some(line) = self.line() {
            let part = continued(line);
            whole.push(' ');
            whole.push_str(part.unwrap_or(line));
            if part.is_none() {
                break;
            }
        }
        Some((number, whole.into()))
    }
}

/// The line without the backslash at its end. A comment does not go on: some end in the path of a folder.
fn continued(line: &str) -> Option<&str> {
    let part = line.trim_end().strip_suffix('\\')?;
    (!part.contains('#')).then_some(part)
}

/// The keyword of a statement and what follows it.
pub(super) fn keyword(statement: &str) -> (&str, &str) {
    let statement = statement.trim();
    let (key, rest) = statement
        .split_once(char::is_whitespace)
        .unwrap_or((statement, ""));
    (key, rest.trim())
}

/// What stands before a comment at the end of a line.
pub(super) fn without_comment(text: &str) -> &str {
    text.split_once('#').map_or(text, |(before, _)| before)
}

/// The ways to read a name: whole, and without what may be a comment behind it, as names have `#` too.
pub(super) fn readings(name: &str) -> impl Iterator<Item = &str> {
    let commented = name
        .char_indices()
        .filter(|&(at, letter)| letter == '#' && name[..at].ends_with(char::is_whitespace));
    let before = commented.map(|(at, _)| name[..at].trim_end());
    std::iter::once(name).chain(before)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statements(text: &str) -> Vec<(usize, String)> {
        let all = Statements::new(text);
        all.map(|(line, text)| (line, text.into_owned())).collect()
    }

    #[test]
    fn text_is_read_in_the_encodings_of_all_systems() {
        let mut utf16 = vec![0xFF, 0xFE];
        utf16.extend("v ä".encode_utf16().flat_map(u16::to_le_bytes));
        let mut big = vec![0xFE, 0xFF];
        big.extend("v ä".encode_utf16().flat_map(u16::to_be_bytes));
        for bytes in [
            "v ä".as_bytes(),
            "\u{feff}v ä".as_bytes(),
            b"v \xe4",
            &utf16,
            &big,
        ] {
            assert_eq!(decoded(bytes), "v ä");
        }
        // One line in Latin-1 does not spoil another one in UTF-8.
        let mixed = [b"\xe4\n".as_slice(), "ä".as_bytes()].concat();
        assert_eq!(decoded(&mixed), "ä\nä");
    }

    #[test]
    fn statements_go_on_after_a_backslash_and_keep_the_number_of_their_first_line() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["f 1 \\", "2\\ ", "3", "", "# C:\\", "v 1 # d:\\", "o a"].join(end);
            let found = statements(&text);
            let told: Vec<(usize, &str)> = found.iter().map(|(n, s)| (*n, s.as_str())).collect();
            let rest = [(4, ""), (5, "# C:\\"), (6, "v 1 # d:\\"), (7, "o a")];
            assert_eq!(told[0].0, 1);
            assert_eq!(told[0].1.split_whitespace().collect::<String>(), "f123");
            assert_eq!(told[1..], rest);
        }
        assert_eq!(statements("f 1 \\"), [(1, "f 1 ".to_owned())]);
        assert!(statements("").is_empty());
    }

    #[test]
    fn a_name_may_hold_a_number_sign_or_stand_before_a_comment() {
        assert_eq!(
            readings("a #1 # old").collect::<Vec<_>>(),
            ["a #1 # old", "a", "a #1"]
        );
        assert_eq!(readings("a#1").collect::<Vec<_>>(), ["a#1"]);
        assert_eq!(keyword("\tf\t1 2 "), ("f", "1 2"));
        assert_eq!(without_comment("1 2#3"), "1 2");
    }
}
