//! Whether a Matroska file is truncated. FFmpeg reads a truncated file to its last complete block and
//! then reports a normal end; the sizes in the file show what is missing.
//!
//! Element ids and the coding of sizes are RFC 8794 (EBML) and RFC 9559 (Matroska).

use std::io::{self, Read, Seek, SeekFrom};

const EBML: u32 = 0x1A45_DFA3;
const SEGMENT: u32 = 0x1853_8067;
const CLUSTER: u32 = 0x1F43_B675;

/// Where a file ends too early, or an element does not fit into its parent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Truncation {
    /// Where the incomplete element begins, bytes from the file's start.
    pub element_at: u64,
    /// How many bytes of it are missing; `None` if the file does not state its size.
    pub missing: Option<u64>,
}

/// Looks for a truncated element in `file`; `None` if all elements are complete, or if it is not
/// Matroska.
///
/// # Errors
/// Errors of reading `file`.
pub fn find_truncation(file: &mut (impl Read + Seek)) -> io::Result<Option<Truncation>> {
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(0))?;
    let mut at = 0;
    // Where the current cluster ends.
    let mut cluster_end = length;
    // A segment or cluster that should end after the file's end.
    let mut open = None;
    while at < length {
        if at >= cluster_end {
            cluster_end = length;
        }
        let Some(header) = Header::read(file, at)? else {
            return Ok((at > 0).then_some(Truncation {
                element_at: at,
                missing: None,
            }));
        };
        if at == 0 && header.id != EBML {
            return Ok(None);
        }
        let broken = |missing| {
            Ok(Some(Truncation {
                element_at: at,
                missing,
            }))
        };
        // A segment or cluster of unknown size extends to the next element of its level, so that its
        // children can be visited like those of one long list.
        let enters = header.id == SEGMENT || header.id == CLUSTER;
        at = match header.size.map(|size| header.body_at.saturating_add(size)) {
            Some(end) if end > length && !enters => return broken(Some(end - length)),
            Some(end) if end > cluster_end && !enters => return broken(None),
            Some(end) if enters => {
                if end > length {
                    open = Some(Truncation {
                        element_at: at,
                        missing: Some(end - length),
                    });
                }
                if header.id == CLUSTER {
                    cluster_end = end.min(length);
                }
                header.body_at
            }
            Some(end) if !enters => end,
            None if !enters => return broken(None),
            _ => header.body_at,
        };
        file.seek(SeekFrom::Start(at))?;
    }
    Ok(open)
}

/// An element's id and size.
struct Header {
    id: u32,
    /// `None` where the size was not known when it was written.
    size: Option<u64>,
    body_at: u64,
}

impl Header {
    /// `None` where the file ends inside the header or it is not one.
    fn read(file: &mut impl Read, at: u64) -> io::Result<Option<Self>> {
        let Some((id, id_bytes, _)) = variable_integer(file, 4, false)? else {
            return Ok(None);
        };
        let Some((size, size_bytes, unknown)) = variable_integer(file, 8, true)? else {
            return Ok(None);
        };
        let Ok(id) = u32::try_from(id) else {
            return Ok(None);
        };
        let body_at = at + id_bytes + size_bytes;
        Ok(Some(Self {
            id,
            size: (!unknown).then_some(size),
            body_at,
        }))
    }
}

/// A number whose first byte's leading zeros give its length: (value, bytes, all value bits set).
fn variable_integer(
    file: &mut impl Read,
    longest: u32,
    drop_marker: bool,
) -> io::Result<Option<(u64, u64, bool)>> {
    let Some(first) = next_byte(file)? else {
        return Ok(None);
    };
    let extra = first.leading_zeros();
    if extra >= longest {
        return Ok(None);
    }
    let marker = 0x80_u8 >> extra;
    let mut value = u64::from(if drop_marker { first & !marker } else { first });
    let mut all_set = first & (marker - 1) == marker - 1;
    for _ in 0..extra {
        let Some(byte) = next_byte(file)? else {
            return Ok(None);
        };
        all_set &= byte == 0xFF;
        value = value << 8 | u64::from(byte);
    }
    Ok(Some((value, u64::from(extra) + 1, all_set)))
}

fn next_byte(file: &mut impl Read) -> io::Result<Option<u8>> {
    let mut byte = [0];
    loop {
        match file.read(&mut byte) {
            Ok(0) => return Ok(None),
            Ok(_) => return Ok(Some(byte[0])),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Cursor;

    use super::*;

    const BLOCK: u8 = 0xA3;

    /// An element with a one-byte size.
    fn element(id: &[u8], body: &[u8]) -> Vec<u8> {
        [id, &[0x80 | body.len() as u8], body].concat()
    }

    fn file(known_sizes: bool) -> Vec<u8> {
        let header = element(&EBML.to_be_bytes(), b"head");
        let blocks = [element(&[BLOCK], b"frame 0"), element(&[BLOCK], b"frame 1")].concat();
        let cluster = if known_sizes {
            element(&CLUSTER.to_be_bytes(), &blocks)
        } else {
            [&CLUSTER.to_be_bytes()[..], &[0xFF], &blocks].concat()
        };
        let segment = [&SEGMENT.to_be_bytes()[..], &[0xFF], &cluster].concat();
        [header, segment].concat()
    }

    #[test]
    fn a_complete_file_is_not_truncated() {
        for known in [false, true] {
            assert_eq!(
                find_truncation(&mut Cursor::new(file(known))).unwrap(),
                None
            );
        }
    }

    #[test]
    fn a_truncation_is_found_with_its_place_and_the_missing_bytes() {
        let whole = file(false);
        let cut = find_truncation(&mut Cursor::new(&whole[..whole.len() - 3])).unwrap();
        assert_eq!(
            cut,
            Some(Truncation {
                element_at: whole.len() as u64 - 9,
                missing: Some(3)
            })
        );
    }

    #[test]
    fn a_file_that_is_not_matroska_is_left_alone() {
        for bytes in [&b""[..], b"\0\0\0\x18ftypmp42", b"\xFF\xD8\xFF"] {
            assert_eq!(find_truncation(&mut Cursor::new(bytes)).unwrap(), None);
        }
    }

    #[test]
    fn a_block_that_reaches_beyond_its_cluster_is_found() {
        let mut damaged = file(true);
        let second = damaged.len() - 9;
        damaged.extend(element(
            &CLUSTER.to_be_bytes(),
            &element(&[BLOCK], b"frame 2"),
        ));
        damaged[second + 1] += 3;
        let cut = find_truncation(&mut Cursor::new(damaged)).unwrap();
        assert_eq!(
            cut,
            Some(Truncation {
                element_at: second as u64,
                missing: None
            })
        );
    }

    #[test]
    fn every_truncation_inside_a_block_is_found() {
        let whole = file(true);
        let cluster_body = whole.len() - 18;
        for length in cluster_body..whole.len() {
            let cut = find_truncation(&mut Cursor::new(&whole[..length])).unwrap();
            assert!(cut.is_some(), "cut to {length} of {}", whole.len());
        }
    }
}
