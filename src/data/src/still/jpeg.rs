//! The segments of a JPEG, and whether all of its picture is there: decoders fill up what is missing with grey, and say
//! nothing.

use std::borrow::Cow;
use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, ImageResult};

const SOI: u8 = 0xd8;
const EOI: u8 = 0xd9;
const SOS: u8 = 0xda;
const APP2: u8 = 0xe2;
/// Frames whose blocks come whole, one after the other, with Huffman's codes. Cameras that forget the end marker write no
/// others.
const SEQUENTIAL: [u8; 2] = [0xc0, 0xc1];
/// Bytes that stand in for what may be missing of a scan: more than a decoder reads ahead.
const STAND_IN: usize = 64;

/// The picture, if all of it is there. A file may lack its end marker: then the scan is whole if the picture does not
/// depend on what follows it. `None` if a part of the picture is missing.
pub(crate) fn whole(bytes: &[u8]) -> Option<Cow<'_, [u8]>> {
    if length(bytes).is_some() {
        return Some(Cow::Borrowed(bytes));
    }
    let scan = only_scan(bytes)?;
    // Any bit that is missing is another one in each of them.
    let [one, other] = [0x55, 0xaa].map(|bits| picture(&followed_by(scan, &[bits; STAND_IN])));
    (one.ok()? == other.ok()?).then(|| Cow::Owned(followed_by(scan, &[])))
}

/// The file up to the end of its scan, if that is the only one a whole picture needs.
fn only_scan(bytes: &[u8]) -> Option<&[u8]> {
    let mut segments = segments(bytes);
    let (_, frame, _) = segments.find(|(marker, ..)| SEQUENTIAL.contains(marker))?;
    let (_, scan, start) = segments.find(|(marker, ..)| *marker == SOS)?;
    if frame.get(5) != scan.first() {
        return None;
    }
    let mut end = start;
    while let Some((0x00 | 0xd0..=0xd7, after)) = next_marker(bytes, end) {
        end = after;
    }
    let end = next_marker(bytes, end).map_or(bytes.len(), |(_, after)| after - 2);
    // Bytes 0xff before a marker do not belong to the scan.
    let length = bytes[..end].iter().rposition(|&byte| byte != 0xff)? + 1;
    Some(&bytes[..length])
}

fn followed_by(scan: &[u8], bits: &[u8]) -> Vec<u8> {
    [scan, bits, &[0xff, EOI]].concat()
}

fn picture(bytes: &[u8]) -> ImageResult<DynamicImage> {
    ImageReader::with_format(Cursor::new(bytes), ImageFormat::Jpeg).decode()
}

/// Width and height as the frame's header states them (ITU-T T.81, B.2.2).
pub fn size(bytes: &[u8]) -> Option<(u32, u32)> {
    let (_, frame, _) = segments(bytes).find(|&(marker, ..)| is_frame(marker))?;
    let &[_, y, yy, x, xx] = frame.first_chunk()?;
    let number = |bytes| u32::from(u16::from_be_bytes(bytes));
    Some((number([x, xx]), number([y, yy])))
}

/// How many components its pixels have.
pub(crate) fn components(bytes: &[u8]) -> Option<u8> {
    let (_, frame, _) = segments(bytes).find(|&(marker, ..)| is_frame(marker))?;
    frame.get(5).copied()
}

/// Whether a segment has a part of a colour profile.
pub(crate) fn has_profile(bytes: &[u8]) -> bool {
    segments(bytes)
        .any(|(marker, content, _)| marker == APP2 && content.starts_with(b"ICC_PROFILE\0"))
}

/// Whether a marker begins a frame's header: SOF, and not DHT, JPG or DAC.
fn is_frame(marker: u8) -> bool {
    matches!(marker, 0xc0..=0xcf) && !matches!(marker, 0xc4 | 0xc8 | 0xcc)
}

/// The segments up to that of the first scan: markers, contents, and the places behind them.
fn segments(bytes: &[u8]) -> impl Iterator<Item = (u8, &[u8], usize)> {
    let mut at = 2;
    std::iter::from_fn(move || {
        let found = segment(bytes, at)?;
        at = if found.0 == SOS { bytes.len() } else { found.2 };
        Some(found)
    })
}

/// The next segment from a place on: its marker, its content, and the place behind it.
fn segment(bytes: &[u8], from: usize) -> Option<(u8, &[u8], usize)> {
    let (marker, after) = next_marker(bytes, from)?;
    let length = bytes.get(after..after + 2)?;
    let length = usize::from(u16::from_be_bytes([length[0], length[1]])).max(2);
    let content = bytes.get(after + 2..after + length)?;
    Some((marker, content, after + length))
}

/// The length in bytes of the JPEG at the start of `bytes`, up to its own marker EOI; those of thumbnails lie in
/// segments, which are passed over. `None` if there is none, also where another JPEG begins before it.
pub fn length(bytes: &[u8]) -> Option<usize> {
    let mut at = 2;
    loop {
        let (marker, after) = next_marker(bytes, at)?;
        at = match marker {
            EOI => return Some(after),
            SOI => return None,
            // Markers without a length, and bytes 0xff of a scan.
            0x00 | 0x01 | 0xd0..=0xd7 => after,
            _ => segment(bytes, at)?.2,
        };
    }
}

/// The next marker from a place on, and the place behind it.
fn next_marker(bytes: &[u8], from: usize) -> Option<(u8, usize)> {
    let rest = bytes.get(from..)?;
    let prefix = from + rest.iter().position(|&byte| byte == 0xff)?;
    // A marker may have more than one 0xff before it.
    let length = bytes[prefix..].iter().position(|&byte| byte != 0xff)?;
    Some((bytes[prefix + length], prefix + length + 1))
}

#[cfg(test)]
mod tests {
    use proptest::collection::vec;
    use proptest::prelude::*;

    use super::*;

    /// A JPEG with a thumbnail in a segment, one scan with an escaped 0xff and a restart marker, and fill bytes.
    const WHOLE: [u8; 32] = [
        0xff, 0xd8, 0xff, 0xe1, 0, 8, 0xff, 0xd8, 0xff, 0xd9, 1, 2, 0xff, 0xda, 0, 4, 1, 2, 7,
        0xff, 0x00, 8, 0xff, 0xd0, 9, 10, 11, 0xff, 0xff, 0xff, 0xd9, 0,
    ];

    #[test]
    fn a_jpeg_ends_with_its_own_marker_and_not_with_that_of_a_thumbnail() {
        assert_eq!(length(&WHOLE), Some(31));
        assert_eq!(length(&WHOLE[..31]), Some(31));
        for cut in 0..31 {
            assert_eq!(length(&WHOLE[..cut]), None, "{cut}");
        }
    }

    #[test]
    fn the_end_of_another_picture_behind_it_is_not_its_own() {
        let second = [&WHOLE[..27], &WHOLE[..]].concat();
        assert!(length(&second).is_none());
    }

    #[test]
    fn a_length_that_leads_beyond_the_file_is_no_end() {
        assert!(length(&[0xff, 0xd8, 0xff, 0xe1, 0xff, 0xff, 0xff, 0xd9]).is_none());
        assert!(length(&[0xff; 9]).is_none());
        assert!(length(&[]).is_none());
    }

    #[test]
    fn what_stands_behind_a_jpeg_is_not_part_of_it() {
        // Start, a table, a scan with stuffed bytes and a restart marker, end.
        let jpeg = [
            0xff, 0xd8, 0xff, 0xdb, 0, 3, 9, 0xff, 0xff, 0xda, 0, 2, 7, 0xff, 0, 9, 0xff, 0xd3, 8,
            0xff, 0xd9,
        ];
        for behind in [&[][..], &[0; 40], &jpeg, &[0xff, 0xd9]] {
            let data = [&jpeg[..], behind].concat();
            assert_eq!(length(&data), Some(jpeg.len()), "{behind:?}");
        }
        for cut in 0..jpeg.len() {
            assert_eq!(length(&jpeg[..cut]), None, "cut to {cut}");
        }
    }

    proptest! {
        #[test]
        fn no_bytes_have_a_jpeg_longer_than_they_are(data in vec(any::<u8>(), 0..80)) {
            prop_assert!(length(&data).is_none_or(|found| found <= data.len()));
        }
    }
}
