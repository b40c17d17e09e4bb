//! Text in files as other programs write it: UTF-8, with or without a byte order mark.

use std::fs;
use std::io;
use std::path::Path;

const UTF8_MARK: &[u8] = b"\xef\xbb\xbf";
const UTF16_MARKS: [&[u8]; 2] = [b"\xff\xfe", b"\xfe\xff"];

/// The text of a file, without its byte order mark.
///
/// # Errors
/// If the file cannot be read; with the kind `InvalidData` if it is not UTF-8.
pub fn read(path: &Path) -> io::Result<String> {
    let text = decode(fs::read(path)?);
    text.map_err(|fault| io::Error::new(io::ErrorKind::InvalidData, fault))
}

/// The text of a file's content, without its byte order mark.
///
/// # Errors
/// What to do if it is not UTF-8.
pub fn decode(mut bytes: Vec<u8>) -> Result<String, String> {
    if UTF16_MARKS.iter().any(|mark| bytes.starts_with(mark)) {
        return Err("it is UTF-16: save it as UTF-8".to_owned());
    }
    let mark = bytes.len() - unmarked(&bytes).len();
    bytes.drain(..mark);
    String::from_utf8(bytes).map_err(|fault| {
        let place = mark + fault.utf8_error().valid_up_to();
        format!("it is not UTF-8, first at byte {place}: save it as UTF-8")
    })
}

/// A file's content without a byte order mark of UTF-8, which parsers of JSON refuse.
pub fn unmarked(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(UTF8_MARK).unwrap_or(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_text() {
        let decoded = |bytes: &[u8]| decode(bytes.to_vec());
        assert_eq!(decoded(b"\xef\xbb\xbf1 2 3"), Ok("1 2 3".to_owned()));
        assert_eq!(decoded(b"1 2 3"), Ok("1 2 3".to_owned()));
        assert_eq!(decoded(b""), Ok(String::new()));
        assert_eq!(unmarked(b"\xef\xbb\xbf{}"), b"{}");
    }

    #[test]
    fn other_encodings_are_named() {
        let refused = |bytes: &[u8]| decode(bytes.to_vec()).unwrap_err();
        assert!(refused(b"\xff\xfe1\0").contains("UTF-16"));
        assert!(refused(b"\xfe\xff\x001").contains("UTF-16"));
        assert!(refused(b"\xef\xbb\xbfab\xe4").contains("byte 5"));
    }
}
