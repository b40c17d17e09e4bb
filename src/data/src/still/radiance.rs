//! Radiance's pictures (HDR, RGBE, XYZE): their header, and their pixels as the crate image decodes them.

use std::io::Read;

use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder, ImageError};

use crate::still::colour::{Matrix, Primaries, to_rec709 as matrix_of};
use crate::still::decode::reserve;
use crate::still::{ColourError, StillError};

/// The longest header, bytes.
const MAX_HEADER_LENGTH: usize = 65_536;

/// What a header says.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Header {
    primaries: Option<Primaries>,
    /// What the pixels were multiplied by.
    gains: [f32; 3],
    layout: Layout,
    /// Where the pixels begin.
    data: usize,
}

/// In which order the pixels stand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Layout {
    lines: u32,
    length: u32,
    /// The lines are columns of the picture.
    is_transposed: bool,
    from_right: bool,
    from_below: bool,
}

/// The matrix from the primaries that the file states to Rec. 709, which it has without a statement.
pub(crate) fn to_rec709(bytes: &[u8]) -> Result<Option<Matrix>, ColourError> {
    match Header::read(bytes).and_then(|header| header.primaries) {
        Some(primaries) => matrix_of(primaries),
        None => Ok(None),
    }
}

/// Width and height as displayed.
pub(crate) fn size(bytes: &[u8]) -> Option<(u32, u32)> {
    let Layout {
        lines,
        length,
        is_transposed,
        ..
    } = Header::read(bytes)?.layout;
    Some(if is_transposed {
        (lines, length)
    } else {
        (length, lines)
    })
}

/// The picture as displayed, before its exposure was changed.
pub(crate) fn decode(bytes: &[u8]) -> Result<DynamicImage, StillError> {
    let unreadable = || {
        let fault = std::io::Error::from(std::io::ErrorKind::InvalidData);
        StillError::Decode(ImageError::IoError(fault))
    };
    let header = Header::read(bytes).ok_or_else(unreadable)?;
    let layout = header.layout;
    // The decoder knows one signature, one layout and no statements.
    let plain = format!(
        "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n",
        layout.lines, layout.length
    );
    let file = plain.as_bytes().chain(&bytes[header.data..]);
    let decoder = HdrDecoder::new(file).map_err(StillError::Decode)?;
    reserve(decoder.total_bytes())?;
    let image = DynamicImage::from_decoder(decoder).map_err(StillError::Decode)?;
    let mut image = layout.displayed(image).into_rgb32f();
    if header.gains != [1.0; 3] {
        for pixel in image.pixels_mut() {
            for (value, gain) in pixel.0.iter_mut().zip(header.gains) {
                *value /= gain;
            }
        }
    }
    Ok(DynamicImage::ImageRgb32F(image))
}

impl Header {
    fn read(bytes: &[u8]) -> Option<Self> {
        let head = &bytes[..bytes.len().min(MAX_HEADER_LENGTH)];
        let (mut primaries, mut is_xyz, mut gains) = (None, false, [1.0; 3]);
        let mut at = 0;
        loop {
            let line = line_at(head, &mut at)?;
            let Some((key, value)) = line.split_once('=') else {
                match line.trim() {
                    "" => break,
                    _ => continue,
                }
            };
            match key.trim() {
                "FORMAT" => is_xyz = value.trim() == "32-bit_rle_xyze",
                "PRIMARIES" => primaries = numbers(value).map(Primaries::from_numbers),
                "EXPOSURE" => {
                    multiply(&mut gains, numbers(value).map(|[gain]: [f64; 1]| [gain; 3]))
                }
                "COLORCORR" => multiply(&mut gains, numbers(value)),
                _ => {}
            }
        }
        let layout = Layout::read(&line_at(head, &mut at)?)?;
        Some(Self {
            primaries: if is_xyz {
                Some(Primaries::XYZ)
            } else {
                primaries
            },
            gains,
            layout,
            data: at,
        })
    }
}

/// The line from a place on, which moves behind it.
fn line_at(bytes: &[u8], at: &mut usize) -> Option<String> {
    let rest = bytes.get(*at..)?;
    let length = rest.iter().position(|&byte| byte == b'\n')?;
    *at += length + 1;
    let line = rest[..length]
        .strip_suffix(b"\r")
        .unwrap_or(&rest[..length]);
    Some(String::from_utf8_lossy(line).into_owned())
}

fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let numbers: Option<Vec<f64>> = text
        .split_whitespace()
        .map(|word| word.parse().ok())
        .collect();
    numbers?.try_into().ok()
}

/// Statements of this kind add up. Impossible ones are left out.
fn multiply(gains: &mut [f32; 3], by: Option<[f64; 3]>) {
    let Some(by) = by.filter(|by| by.iter().all(|&gain| gain.is_finite() && gain > 0.0)) else {
        return;
    };
    for (gain, by) in gains.iter_mut().zip(by) {
        *gain *= by as f32;
    }
}

impl Layout {
    /// Reads a line such as `-Y 512 +X 1024`.
    fn read(line: &str) -> Option<Self> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let &[first, lines, second, length] = &words[..] else {
            return None;
        };
        let (vertical, horizontal, is_transposed) = match (first.get(1..)?, second.get(1..)?) {
            ("Y", "X") => (first, second, false),
            ("X", "Y") => (second, first, true),
            _ => return None,
        };
        let is_positive = |axis: &str| match axis.chars().next() {
            Some('+') => Some(true),
            Some('-') => Some(false),
            _ => None,
        };
        Some(Self {
            lines: lines.parse().ok()?,
            length: length.parse().ok()?,
            is_transposed,
            from_right: !is_positive(horizontal)?,
            from_below: is_positive(vertical)?,
        })
    }

    fn displayed(self, mut image: DynamicImage) -> DynamicImage {
        if self.is_transposed {
            image = image.rotate90().fliph();
        }
        if self.from_right {
            image = image.fliph();
        }
        if self.from_below {
            image = image.flipv();
        }
        image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Six pixels of 3 x 2, red 10 to 15, green 64, blue 0, where 128 is a half; `lines` of `length`.
    fn file(header: &str, layout: &str, reds: [u8; 6]) -> Vec<u8> {
        let mut bytes = format!("{header}\n{layout}\n").into_bytes();
        bytes.extend(reds.into_iter().flat_map(|red| [red, 64, 0, 128]));
        bytes
    }

    fn reds(bytes: &[u8]) -> Vec<u8> {
        let image = decode(bytes).unwrap().into_rgb32f();
        image
            .pixels()
            .map(|pixel| (pixel.0[0] * 256.0).round() as u8)
            .collect()
    }

    const PLAIN: &str = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n";
    const UP: &str = "-Y 2 +X 3";

    #[test]
    fn any_signature_and_line_end_is_read() {
        for header in [
            PLAIN,
            "#?RGBE\nFORMAT=32-bit_rle_rgbe\n",
            "#?AUTOPANO\nFORMAT=32-bit_rle_rgbe\nSOFTWARE=x\n",
            "#?RADIANCE\n# a comment\n",
            "#?RADIANCE\r\nFORMAT=32-bit_rle_rgbe\r\n\r",
        ] {
            let file = file(header, UP, [10, 11, 12, 13, 14, 15]);
            assert_eq!(reds(&file), [10, 11, 12, 13, 14, 15], "{header:?}");
        }
    }

    #[test]
    fn the_eight_layouts_show_the_same_picture() {
        // The picture is 10 11 12 over 13 14 15.
        for (layout, stored) in [
            ("-Y 2 +X 3", [10, 11, 12, 13, 14, 15]),
            ("+Y 2 +X 3", [13, 14, 15, 10, 11, 12]),
            ("-Y 2 -X 3", [12, 11, 10, 15, 14, 13]),
            ("+Y 2 -X 3", [15, 14, 13, 12, 11, 10]),
            ("+X 3 -Y 2", [10, 13, 11, 14, 12, 15]),
            ("-X 3 -Y 2", [12, 15, 11, 14, 10, 13]),
            ("+X 3 +Y 2", [13, 10, 14, 11, 15, 12]),
            ("-X 3 +Y 2", [15, 12, 14, 11, 13, 10]),
        ] {
            let file = file(PLAIN, layout, stored);
            assert_eq!(reds(&file), [10, 11, 12, 13, 14, 15], "{layout}");
            assert_eq!(size(&file), Some((3, 2)), "{layout}");
        }
    }

    #[test]
    fn a_changed_exposure_is_taken_back() {
        let header = format!("{PLAIN}EXPOSURE=2\nEXPOSURE= 0.25\nCOLORCORR=1 2 1\nEXPOSURE=0\n");
        let image = decode(&file(&header, UP, [10; 6])).unwrap().into_rgb32f();
        assert_eq!(image.get_pixel(0, 0).0, [20.0 / 256.0, 64.0 / 256.0, 0.0]);
    }

    #[test]
    fn primaries_and_xyz_are_stated_in_the_header() {
        let matrix = |header: &str| to_rec709(&file(header, UP, [10; 6]));
        assert_eq!(matrix(PLAIN), Ok(None));
        let rec709 = format!("{PLAIN}PRIMARIES=.64 .33 .3 .6 .15 .06 .3127 .329\n");
        assert_eq!(matrix(&rec709), Ok(None));
        let wide = format!("{PLAIN}PRIMARIES=.708 .292 .170 .797 .131 .046 .3127 .329\n");
        assert!(matrix(&wide).unwrap().unwrap()[0][0] > 1.6);
        assert!(
            matrix("#?RADIANCE\nFORMAT=32-bit_rle_xyze\n")
                .unwrap()
                .is_some()
        );
        let flat = format!("{PLAIN}PRIMARIES=0 0 0 0 0 0 0 0\n");
        assert!(matrix(&flat).is_err());
    }

    #[test]
    fn half_a_file_is_refused() {
        let whole = file(PLAIN, UP, [10, 11, 12, 13, 14, 15]);
        for length in 0..whole.len() {
            assert!(decode(&whole[..length]).is_err(), "{length}");
        }
    }
}
