//! Arrays of NumPy: files .npy of floating point numbers.

use crate::image::{Extent, Planes};

/// What such a file begins with.
const MAGIC: &[u8] = b"\x93NUMPY";

/// The picture in the content of a file: height x width x 3 numbers of 32 or 64 bits, or height x width of them, which
/// become three equal channels.
pub(super) fn planes(bytes: &[u8]) -> Result<Planes<3>, String> {
    let (header, values) = header(bytes).ok_or("it is no file of NumPy, version 1 to 3")?;
    let (width_of_number, wide) = match quoted(header, "descr") {
        Some("<f4") => (4, false),
        Some("<f8") => (8, true),
        other => {
            return Err(format!(
                "its numbers are {}, not <f4 or <f8",
                other.unwrap_or("unknown")
            ));
        }
    };
    if after(header, "fortran_order").is_some_and(|rest| rest.starts_with("True")) {
        return Err("it is stored column by column (fortran_order)".to_owned());
    }
    let shape = shape(header).ok_or("its header names no shape")?;
    let (extent, channels) = match shape[..] {
        [height, width] => (Extent::new(width, height), 1),
        [height, width, channels @ 3..=4] => (Extent::new(width, height), channels),
        _ => return Err(format!("its shape is {shape:?}, not height x width x 3")),
    };
    let count = extent
        .width
        .checked_mul(extent.height)
        .and_then(|pixels| pixels.checked_mul(channels * width_of_number));
    if count != Some(values.len()) {
        return Err(format!(
            "it has {} bytes of numbers, which its shape {shape:?} does not say",
            values.len()
        ));
    }
    let number = |at: usize| {
        let bytes = &values[at * width_of_number..][..width_of_number];
        if wide {
            bytes.try_into().map_or(0.0, f64::from_le_bytes) as f32
        } else {
            bytes.try_into().map_or(0.0, f32::from_le_bytes)
        }
    };
    Ok(Planes::from_fn(extent, |x, y| {
        let first = (y * extent.width + x) * channels;
        [0, 1, 2].map(|channel| number(first + channel.min(channels - 1)))
    }))
}

/// The header's text, and what comes behind it.
fn header(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(MAGIC)?;
    let (&major, rest) = rest.split_first()?;
    let rest = rest.get(1..)?;
    let (length, rest) = match major {
        1 => {
            let (length, rest) = rest.split_first_chunk::<2>()?;
            (usize::from(u16::from_le_bytes(*length)), rest)
        }
        2 | 3 => {
            let (length, rest) = rest.split_first_chunk::<4>()?;
            (u32::from_le_bytes(*length) as usize, rest)
        }
        _ => return None,
    };
    let (text, values) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(text).ok()?, values))
}

/// What stands behind a key.
fn after<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = header.split_once(&format!("'{key}':"))?;
    Some(rest.trim_start())
}

fn quoted<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let rest = after(header, key)?.strip_prefix('\'')?;
    Some(rest.split_once('\'')?.0)
}

fn shape(header: &str) -> Option<Vec<usize>> {
    let rest = after(header, "shape")?.strip_prefix('(')?;
    let inside = rest.split_once(')')?.0;
    let sides = inside.split(',').map(str::trim).filter(|s| !s.is_empty());
    sides.map(|side| side.parse().ok()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(descr: &str, shape: &str, values: &[u8]) -> Vec<u8> {
        let header =
            format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}\n");
        let mut bytes = MAGIC.to_vec();
        bytes.extend([1, 0]);
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(values);
        bytes
    }

    #[test]
    fn numbers_of_32_and_64_bits_are_read_row_by_row() {
        let narrow: Vec<u8> = (0..12).flat_map(|k| (k as f32).to_le_bytes()).collect();
        let found = planes(&file("<f4", "(2, 2, 3)", &narrow)).unwrap();
        assert_eq!(found.pixel(1, 0), [3.0, 4.0, 5.0]);
        assert_eq!(found.pixel(0, 1), [6.0, 7.0, 8.0]);
        let wide: Vec<u8> = (0..6).flat_map(|k| f64::from(k).to_le_bytes()).collect();
        let found = planes(&file("<f8", "(2, 3)", &wide)).unwrap();
        assert_eq!(found.pixel(2, 1), [5.0; 3]);
    }

    #[test]
    fn what_cannot_be_read_is_said() {
        let fault = |bytes: &[u8]| planes(bytes).unwrap_err();
        assert!(fault(b"P6").contains("NumPy"));
        assert!(fault(&file("|u1", "(1, 1, 3)", &[0; 3])).contains("|u1"));
        assert!(fault(&file("<f4", "(2, 2, 3)", &[0; 12])).contains("12 bytes"));
        assert!(fault(&file("<f4", "(4,)", &[0; 16])).contains("shape"));
        let huge = format!("({0}, {0}, 3)", u64::MAX / 4);
        assert!(fault(&file("<f4", &huge, &[0; 12])).contains("bytes"));
        let cut = &file("<f4", "(2, 2, 3)", &[])[..12];
        assert!(fault(cut).contains("NumPy"));
    }
}
