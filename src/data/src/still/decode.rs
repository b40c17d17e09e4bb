//! The content of a file as the picture that is displayed.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader, Limits};

use crate::still::orientation::orientation;
use crate::still::{Format, StillError, exr, jpeg, radiance};

/// Decodes the content of a file, turned as it is displayed. The numbers stay as they are stored; what they stand for
/// says [`crate::still::Colour::from_file`].
///
/// # Errors
/// If the format is not supported, or the picture is too large or cut off.
pub fn decode(bytes: &[u8]) -> Result<DynamicImage, StillError> {
    if bytes.is_empty() {
        return Err(StillError::CutOff);
    }
    let format = Format::sniff(bytes);
    match format {
        Some(Format::Radiance) => return radiance::decode(bytes),
        Some(Format::Exr) => return exr::decode(bytes),
        _ => {}
    }
    if let Some((name, advice)) = format.and_then(Format::unsupported) {
        return Err(StillError::NotRead(format!(
            "is {name}, which is not supported: {advice}"
        )));
    }
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let reader = reader.map_err(|fault| StillError::Decode(ImageError::IoError(fault)))?;
    let decoder = reader.into_decoder().map_err(decoding)?;
    reserve(decoder.total_bytes())?;
    let mut image = match format {
        Some(Format::Jpeg) => {
            let whole = jpeg::whole(bytes).ok_or(StillError::CutOff)?;
            let reader = ImageReader::with_format(Cursor::new(&whole[..]), ImageFormat::Jpeg);
            DynamicImage::from_decoder(reader.into_decoder().map_err(decoding)?)
        }
        Some(Format::WebP) if !fills_its_container(bytes) => return Err(StillError::CutOff),
        _ => DynamicImage::from_decoder(decoder),
    }
    .map_err(decoding)?;
    if let Some(orientation) = orientation(bytes) {
        image.apply_orientation(orientation);
    }
    Ok(image)
}

/// Width and height that a file says it has, before it is turned; `None` if they cannot be read.
pub fn stored_size(bytes: &[u8]) -> Option<(u32, u32)> {
    match Format::sniff(bytes)? {
        Format::Radiance => radiance::size(bytes),
        Format::Exr => exr::size(bytes),
        _ => {
            let reader = ImageReader::new(Cursor::new(bytes));
            reader.with_guessed_format().ok()?.into_dimensions().ok()
        }
    }
}

/// Refuses pictures that take too much memory.
pub(crate) fn reserve(bytes: u64) -> Result<(), StillError> {
    Limits::default()
        .reserve(bytes)
        .map_err(|_| StillError::TooLarge)
}

fn decoding(fault: ImageError) -> StillError {
    match fault {
        ImageError::Limits(_) => StillError::TooLarge,
        fault => StillError::Decode(fault),
    }
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

    #[test]
    fn an_empty_file_is_cut_off() {
        assert!(matches!(decode(b""), Err(StillError::CutOff)));
    }

    #[test]
    fn a_webp_is_as_long_as_it_says() {
        let whole = b"RIFF\x08\0\0\0WEBPVP8 ";
        assert!(fills_its_container(whole));
        assert!(!fills_its_container(&whole[..15]));
    }
}
