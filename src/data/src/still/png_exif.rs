//! Exif's data in a PNG. The chunk may stand behind the pixels, where decoders have stopped.

/// The content of the chunk eXIf.
pub(crate) fn find(bytes: &[u8]) -> Option<&[u8]> {
    let mut rest = bytes.get(8..)?;
    loop {
        let length = u32::from_be_bytes(rest.get(..4)?.try_into().ok()?);
        let end = usize::try_from(length).ok()?.checked_add(8)?;
        let content = rest.get(8..end)?;
        if &rest[4..8] == b"eXIf" {
            return Some(content);
        }
        // Behind the content stands its checksum.
        rest = rest.get(end.checked_add(4)?..)?;
    }
}
