//! Whether the content of a file goes on to its end: decoders fill up what is missing of a JPEG with grey, and say nothing.

use image::ImageFormat;

/// Whether a JPEG or WebP ends before the picture does. Decoders of the other formats refuse half a file themselves.
pub(super) fn is_cut_off(format: Option<ImageFormat>, bytes: &[u8]) -> bool {
    match format {
        Some(ImageFormat::Jpeg) => !has_end(bytes),
        Some(ImageFormat::WebP) => !fills_its_container(bytes),
        _ => false,
    }
}

/// Whether a JPEG has a marker EOI of its own; those of thumbnails lie in segments, which are passed over.
fn has_end(bytes: &[u8]) -> bool {
    let mut at = 0;
    while let Some((marker, after)) = next_marker(bytes, at) {
        at = match marker {
            0xd9 => return true,
            // Markers without a length, and bytes 0xff of a scan.
            0x00 | 0x01 | 0xd0..=0xd8 => after,
            _ => match bytes.get(after..after + 2) {
                Some(&[high, low]) => after + usize::from(u16::from_be_bytes([high, low])).max(2),
                _ => return false,
            },
        };
    }
    false
}

/// The next marker from a place on, and the place behind it.
fn next_marker(bytes: &[u8], from: usize) -> Option<(u8, usize)> {
    let rest = bytes.get(from..)?;
    let prefix = from + rest.iter().position(|&byte| byte == 0xff)?;
    // A marker may have more than one 0xff before it.
    let length = bytes[prefix..].iter().position(|&byte| byte != 0xff)?;
    Some((bytes[prefix + length], prefix + length + 1))
}

/// Whether a WebP is as long as its RIFF header says.
fn fills_its_container(bytes: &[u8]) -> bool {
    match bytes.get(4..8) {
        Some(&[a, b, c, d]) => {
            bytes.len() as u64 >= 8 + u64::from(u32::from_le_bytes([a, b, c, d]))
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A JPEG with a thumbnail in a segment, one scan with an escaped 0xff and a restart marker, and fill bytes.
    const WHOLE: [u8; 32] = [
        0xff, 0xd8, 0xff, 0xe1, 0, 8, 0xff, 0xd8, 0xff, 0xd9, 1, 2, 0xff, 0xda, 0, 4, 1, 2, 7,
        0xff, 0x00, 8, 0xff, 0xd0, 9, 10, 11, 0xff, 0xff, 0xff, 0xd9, 0,
    ];

    #[test]
    fn a_jpeg_ends_with_its_own_marker_and_not_with_that_of_a_thumbnail() {
        assert!(has_end(&WHOLE));
        assert!(has_end(&WHOLE[..31]));
        for length in 0..31 {
            assert!(!has_end(&WHOLE[..length]), "{length}");
        }
    }

    #[test]
    fn a_length_that_leads_beyond_the_file_is_no_end() {
        assert!(!has_end(&[0xff, 0xd8, 0xff, 0xe1, 0xff, 0xff, 0xff, 0xd9]));
        assert!(!has_end(&[0xff; 9]));
    }

    #[test]
    fn a_webp_is_as_long_as_it_says() {
        let whole = b"RIFF\x08\0\0\0WEBPVP8 ";
        assert!(!is_cut_off(Some(ImageFormat::WebP), whole));
        assert!(is_cut_off(Some(ImageFormat::WebP), &whole[..15]));
        assert!(!is_cut_off(Some(ImageFormat::Png), &whole[..3]));
    }
}
