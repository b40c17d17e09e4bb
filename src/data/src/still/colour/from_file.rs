//! What a file says about its colours.

use std::io::Cursor;

use image::{ColorType, ImageDecoder, ImageReader};

use super::icc::colour_of_profile;
use super::{Colour, Curve, Primaries, png_chunks, to_rec709};
use crate::still::tiff::{self, Directory};
use crate::still::{ColourError, Format, exr, jpeg, png_exif, radiance};

/// Exif's colour spaces.
const EXIF_ADOBE_RGB: u32 = 2;
const EXIF_UNCALIBRATED: u32 = 0xffff;
/// TIFF's interpretation of samples as inks.
const SEPARATED: u32 = 5;

impl Colour {
    /// What the content of a file says; sRGB where it says nothing, and light of Rec. 709 in EXR and HDR.
    ///
    /// # Errors
    /// If it says what is not converted.
    pub fn from_file(bytes: &[u8]) -> Result<Self, ColourError> {
        match Format::sniff(bytes) {
            Some(Format::Exr) => Ok(Self::light(exr::to_rec709(bytes)?)),
            Some(Format::Radiance) => Ok(Self::light(radiance::to_rec709(bytes)?)),
            Some(Format::Png) => of_png(bytes),
            Some(format @ (Format::Jpeg | Format::WebP | Format::Tiff | Format::Bmp)) => {
                check_inks(format, bytes)?;
                of_decoder(format, bytes)
            }
            _ => Ok(Self::SRGB),
        }
    }
}

fn of_png(bytes: &[u8]) -> Result<Colour, ColourError> {
    // What cannot be read says nothing.
    let Ok(reader) = png::Decoder::new(Cursor::new(bytes)).read_info() else {
        return Ok(Colour::SRGB);
    };
    let info = reader.info();
    let is_grey = matches!(
        info.color_type,
        png::ColorType::Grayscale | png::ColorType::GrayscaleAlpha
    );
    if let Some(colour) = png_chunks::stated(info, is_grey)? {
        return Ok(colour);
    }
    png_exif::find(bytes).map_or(Ok(Colour::SRGB), of_exif)
}

fn check_inks(format: Format, bytes: &[u8]) -> Result<(), ColourError> {
    let has_inks = match format {
        Format::Jpeg => jpeg::components(bytes) == Some(4),
        Format::Tiff => {
            let directory = Directory::first(bytes);
            directory.and_then(|directory| directory.number(tiff::PHOTOMETRIC)) == Some(SEPARATED)
        }
        _ => false,
    };
    if has_inks {
        Err(ColourError("has its colours in CMYK".to_owned()))
    } else {
        Ok(())
    }
}

fn of_decoder(format: Format, bytes: &[u8]) -> Result<Colour, ColourError> {
    let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
    let Some(mut decoder) = reader.ok().and_then(|reader| reader.into_decoder().ok()) else {
        return Ok(Colour::SRGB);
    };
    let is_float = matches!(decoder.color_type(), ColorType::Rgb32F | ColorType::Rgba32F);
    let is_grey = !decoder.color_type().has_color();
    match decoder.icc_profile() {
        Ok(Some(icc)) => return colour_of_profile(&icc, is_grey),
        _ if format == Format::Jpeg && jpeg::has_profile(bytes) => {
            return Err(ColourError::profile());
        }
        _ if is_float => return Ok(Colour::LINEAR),
        _ => {}
    }
    match decoder.exif_metadata() {
        Ok(Some(exif)) => of_exif(&exif),
        _ if format == Format::Tiff => of_exif(bytes),
        _ => Ok(Colour::SRGB),
    }
}

/// Cameras say Adobe RGB by the interoperability R03 of DCF, and some by a number that Exif does not have.
fn of_exif(exif: &[u8]) -> Result<Colour, ColourError> {
    let exif = exif.strip_prefix(b"Exif\0\0").unwrap_or(exif);
    let Some(below) = Directory::first(exif).and_then(|first| first.below(tiff::EXIF_IFD)) else {
        return Ok(Colour::SRGB);
    };
    let interoperability = below.below(tiff::INTEROPERABILITY_IFD);
    let index = interoperability.and_then(|ifd| ifd.short_text(tiff::INTEROPERABILITY_INDEX));
    let is_adobe = match below.number(tiff::COLOUR_SPACE) {
        Some(EXIF_ADOBE_RGB) => true,
        Some(EXIF_UNCALIBRATED) | None => index == Some(b"R03"),
        Some(_) => false,
    };
    if !is_adobe {
        return Ok(Colour::SRGB);
    }
    let matrix = to_rec709(Primaries::ADOBE_RGB)?;
    Ok(Colour::new(Curve::Power(563.0 / 256.0), matrix))
}
