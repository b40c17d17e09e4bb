//! Text as programs write it: with a byte order mark or without, in UTF-8 or Latin-1, on lines that go on.

use std::borrow::Cow;

use relit_data::text::unmarked;

/// The text of a file. What is not UTF-8 is read as Latin-1, which always succeeds.
pub(super) fn decoded(bytes: &[u8]) -> Cow<'_, str> {
    let bytes = unmarked(bytes);
    match str::from_utf8(bytes) {
        Ok(text) => text.into(),
        Err(_) => bytes.iter().copied().map(char::from).collect(),
    }
}

/// The statements of a Wavefront file, each with the number of its first line, counted from 1: a line that ends in a
/// backslash goes on in the next one.
pub(super) fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    let mut lines = (1..).zip(text.lines());
    std::iter::from_fn(move || {
        let (number, first) = lines.next()?;
        let Some(part) = continued(first) else {
            return Some((number, first.into()));
        };
        let mut whole = part.to_owned();
        for (_, line) in lines.by_ref() {
            let part = continued(line);
            whole.push(' ');
            whole.push_str(part.unwrap_or(line));
            if part.is_none() {
                break;
            }
        }
        Some((number, whole.into()))
    })
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

    #[test]
    fn text_is_read_in_both_encodings() {
        for bytes in ["v ä".as_bytes(), "\u{feff}v ä".as_bytes(), b"v \xe4"] {
            assert_eq!(decoded(bytes), "v ä");
        }
    }

    #[test]
    fn statements_go_on_after_a_backslash_and_keep_the_number_of_their_first_line() {
        for end in ["\n", "\r\n"] {
            let text = ["f 1 \\", "2\\ ", "3", "", "# C:\\", "v 1 # d:\\", "o a"].join(end);
            let found: Vec<(usize, Cow<'_, str>)> = statements(&text).collect();
            let told: Vec<(usize, &str)> = found.iter().map(|(n, s)| (*n, s.as_ref())).collect();
            let rest = [(4, ""), (5, "# C:\\"), (6, "v 1 # d:\\"), (7, "o a")];
            assert_eq!(told[0].0, 1);
            assert_eq!(told[0].1.split_whitespace().collect::<String>(), "f123");
            assert_eq!(told[1..], rest);
        }
        assert_eq!(statements("f 1 \\").next(), Some((1, "f 1 ".into())));
        assert!(statements("").next().is_none());
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
