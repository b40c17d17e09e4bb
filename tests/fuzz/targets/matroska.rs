//! The search for a truncation in a Matroska file: it reads no byte twice, and what it finds lies
//! inside the file with something missing; up to there only the parent of the element is incomplete.
//! A complete file without its last byte is truncated by that one byte.

#![no_main]
#![allow(clippy::expect_used, reason = "a fuzz target reports by a panic")]

use std::io::{self, Cursor, Read, Seek, SeekFrom};

use libfuzzer_sys::fuzz_target;
use relit_video::{Truncation, find_truncation};

/// The id of the element that a Matroska file begins with.
const EBML: [u8; 4] = [0x1A, 0x45, 0xDF, 0xA3];
/// Longest header of an element.
const MAX_HEADER_LENGTH: usize = 12;

fuzz_target!(|bytes: &[u8]| match search(bytes) {
    Some(cut) => {
        let before = usize::try_from(cut.element_at).expect("a place in memory");
        if let Some(holder) = search(&bytes[..before]) {
            assert!(holder.element_at < cut.element_at && holder.missing.is_some());
        }
    }
    None if bytes.len() > MAX_HEADER_LENGTH && starts_as_matroska(bytes) => {
        let cut = search(&bytes[..bytes.len() - 1]).expect("a byte is missing");
        assert!(cut.missing.is_none_or(|missing| missing == 1));
    }
    None => {}
});

/// Whether the first header is one: a size does not begin with a byte of zero.
fn starts_as_matroska(bytes: &[u8]) -> bool {
    bytes.starts_with(&EBML) && bytes.get(EBML.len()) != Some(&0)
}

fn search(bytes: &[u8]) -> Option<Truncation> {
    let length = bytes.len() as u64;
    let mut file = Counted {
        bytes: Cursor::new(bytes),
        reads: 0,
    };
    let found = find_truncation(&mut file).expect("memory can be read");
    // All bytes and, once, the end.
    assert!(file.reads <= length + 1, "{} reads", file.reads);
    if let Some(cut) = found {
        assert!(cut.element_at < length);
        assert!(cut.missing != Some(0));
    }
    found
}

struct Counted<'a> {
    bytes: Cursor<&'a [u8]>,
    reads: u64,
}

impl Read for Counted<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reads += 1;
        self.bytes.read(buffer)
    }
}

impl Seek for Counted<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}
