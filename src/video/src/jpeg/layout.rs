//! What a JPEG's markers say (ITU-T T.81, annex B).

use super::NotDecoded;

const SOI: u8 = 0xD8;
const EOI: u8 = 0xD9;
const SOS: u8 = 0xDA;
const BASELINE: u8 = 0xC0;
const HUFFMAN_TABLES: u8 = 0xC4;
const RESTARTS: std::ops::RangeInclusive<u8> = 0xD0..=0xD7;
/// Frames of other kinds than baseline: progressive, lossless, arithmetic.
const OTHER_FRAMES: std::ops::RangeInclusive<u8> = 0xC1..=0xCF;

/// Width and height of a JPEG that is one complete scan of the baseline process with 8 bits a sample, grey or
/// with chroma as 4:4:4, 4:2:2 or 4:2:0.
pub(super) fn size_of_plain(jpeg: &[u8]) -> Result<(u32, u32), NotDecoded> {
    if !jpeg.starts_with(&[0xFF, SOI]) {
        return Err(NotDecoded);
    }
    let mut size = None;
    let mut at = 2;
    loop {
        let (marker, segment, next) = segment(jpeg, at)?;
        match marker {
            BASELINE if size.is_none() => size = Some(plain_frame(segment)?),
            SOS => {
                let size = size.ok_or(NotDecoded)?;
                return one_scan(jpeg.get(next..).ok_or(NotDecoded)?).map(|()| size);
            }
            HUFFMAN_TABLES => {}
            _ if marker == BASELINE || OTHER_FRAMES.contains(&marker) => return Err(NotDecoded),
            _ => {}
        }
        at = next;
    }
}

/// The marker at `at`, the bytes of its segment, and where the next one begins.
fn segment(jpeg: &[u8], at: usize) -> Result<(u8, &[u8], usize), NotDecoded> {
    let mut at = at;
    if jpeg.get(at) != Some(&0xFF) {
        return Err(NotDecoded);
    }
    // A marker may be preceded by any number of fill bytes.
    while jpeg.get(at + 1) == Some(&0xFF) {
        at += 1;
    }
    let &[marker, high, low] = jpeg.get(at + 1..at + 4).ok_or(NotDecoded)? else {
        return Err(NotDecoded);
    };
    if matches!(marker, 0 | 1 | SOI | EOI) || RESTARTS.contains(&marker) {
        return Err(NotDecoded);
    }
    let next = at + 2 + usize::from(u16::from_be_bytes([high, low]));
    Ok((marker, jpeg.get(at + 4..next).ok_or(NotDecoded)?, next))
}

fn plain_frame(segment: &[u8]) -> Result<(u32, u32), NotDecoded> {
    let (&[bits, h1, h0, w1, w0, count], components) =
        segment.split_first_chunk::<6>().ok_or(NotDecoded)?;
    let size = [[w1, w0], [h1, h0]].map(|bytes| u32::from(u16::from_be_bytes(bytes)));
    let factors: Vec<(u8, u8)> = components
        .chunks_exact(3)
        .map(|component| (component[1] >> 4, component[1] & 15))
        .collect();
    let plain = match factors.as_slice() {
        [_] => true,
        [(h, v), blue, red] => {
            let of_chroma = |across, down| *h == across * blue.0 && *v == down * blue.1;
            blue == red && (of_chroma(1, 1) || of_chroma(2, 1) || of_chroma(2, 2))
        }
        _ => false,
    };
    let right = bits == 8 && plain && usize::from(count) == factors.len() && !size.contains(&0);
    right.then_some((size[0], size[1])).ok_or(NotDecoded)
}

/// That the data of the scan are followed by the end of the picture and by no other marker. Data of a part
/// that is not decoded are checked this far only.
fn one_scan(data: &[u8]) -> Result<(), NotDecoded> {
    let mut rest = data;
    while let Some(found) = rest.iter().position(|&byte| byte == 0xFF) {
        match rest.get(found + 1).ok_or(NotDecoded)? {
            0 => {}
            &EOI => return Ok(()),
            0xFF => {
                rest = &rest[found + 1..];
                continue;
            }
            marker if RESTARTS.contains(marker) => {}
            _ => return Err(NotDecoded),
        }
        rest = &rest[found + 2..];
    }
    Err(NotDecoded)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame header, a scan header and data.
    fn jpeg(frame: u8, factors: &[u8], data: &[u8]) -> Vec<u8> {
        let count = factors.len() as u8;
        let mut bytes = vec![0xFF, SOI, 0xFF, 0xE0, 0, 4, 9, 9];
        bytes.extend([0xFF, 0xFF, frame, 0, 8 + 3 * count, 8, 0, 24, 1, 4, count]);
        bytes.extend(factors.iter().flat_map(|&factor| [1, factor, 0]));
        bytes.extend([0xFF, SOS, 0, 3, 7]);
        bytes.extend(data);
        bytes
    }

    const DATA: [u8; 9] = [1, 0xFF, 0, 2, 0xFF, 0xD3, 0xFF, 0xFF, EOI];

    #[test]
    fn ordinary_pictures_of_cameras_are_taken() {
        for factors in [
            &[0x11][..],
            &[0x11, 0x11, 0x11],
            &[0x21, 0x11, 0x11],
            &[0x22, 0x12, 0x12],
            &[0x22, 0x11, 0x11],
        ] {
            let jpeg = jpeg(BASELINE, factors, &DATA);
            assert_eq!(size_of_plain(&jpeg), Ok((260, 24)), "{factors:?}");
        }
    }

    #[test]
    fn other_kinds_and_incomplete_pictures_are_refused() {
        let plain = [0x21, 0x11, 0x11];
        for (frame, factors) in [
            (0xC1, &plain[..]),
            (0xC2, &plain),
            (BASELINE, &[0x41, 0x11, 0x11]),
            (BASELINE, &[0x12, 0x11, 0x11]),
            (BASELINE, &[0x22, 0x11, 0x21]),
            (BASELINE, &[0x11; 4]),
        ] {
            let jpeg = jpeg(frame, factors, &DATA);
            assert_eq!(size_of_plain(&jpeg), Err(NotDecoded), "{factors:?}");
        }
        for data in [&[1, 2][..], &[1, 0xFF], &[1, 0xFF, SOS, 0xFF, EOI]] {
            assert_eq!(
                size_of_plain(&jpeg(BASELINE, &plain, data)),
                Err(NotDecoded)
            );
        }
        let whole = jpeg(BASELINE, &plain, &DATA);
        for length in 0..whole.len() {
            assert_eq!(size_of_plain(&whole[..length]), Err(NotDecoded), "{length}");
        }
    }
}
