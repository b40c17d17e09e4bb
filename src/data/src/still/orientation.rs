//! The orientation of a picture: Exif, or TIFF's tag.

use std::io::Cursor;

use image::metadata::Orientation;
use image::{ImageDecoder, ImageReader};

use crate::still::{Format, png_exif};

/// How a picture is turned for display: by Exif, or TIFF's tag. `None` if it stands as it is stored,
/// or where its orientation cannot be read.
pub fn orientation(bytes: &[u8]) -> Option<Orientation> {
    let stated = match Format::sniff(bytes)? {
        Format::Png => Orientation::from_exif_chunk(png_exif::find(bytes)?)?,
        Format::Jpeg | Format::WebP | Format::Tiff => {
            let reader = ImageReader::new(Cursor::new(bytes))
                .with_guessed_format()
                .ok()?;
            reader.into_decoder().ok()?.orientation().ok()?
        }
        _ => return None,
    };
    (stated != Orientation::NoTransforms).then_some(stated)
}
