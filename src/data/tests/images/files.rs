//! Files of the tests.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, RgbImage};
use moxcms::ColorProfile;

pub(crate) const SIZE: (u32, u32) = (40, 24);

/// Four areas: red, green, blue and grey.
pub(crate) const AREAS: [[u8; 3]; 4] =
    [[200, 60, 50], [60, 180, 70], [50, 70, 190], [128, 128, 128]];

/// A picture of these colours from left to right.
pub(crate) fn areas(colours: [[u8; 3]; 4]) -> RgbImage {
    RgbImage::from_fn(SIZE.0, SIZE.1, |x, _| {
        image::Rgb(colours[(x / 10) as usize])
    })
}

/// The colours in the middle of the areas.
pub(crate) fn middles(image: &RgbImage) -> [[u8; 3]; 4] {
    [5, 15, 25, 35].map(|x| image.get_pixel(x, SIZE.1 / 2).0)
}

pub(crate) fn encoded(image: impl Into<DynamicImage>, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    image
        .into()
        .write_to(&mut Cursor::new(&mut bytes), format)
        .unwrap();
    bytes
}

/// A PNG with chunks before its pixels.
pub(crate) fn png_with(image: &RgbImage, chunks: &[(&[u8; 4], Vec<u8>)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width(), image.height());
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    for (kind, content) in chunks {
        writer
            .write_chunk(png::chunk::ChunkType(**kind), content)
            .unwrap();
    }
    writer.write_image_data(image.as_raw()).unwrap();
    drop(writer);
    bytes
}

/// A PNG with a colour profile.
pub(crate) fn png_with_profile(image: &RgbImage, profile: &ColorProfile) -> Vec<u8> {
    png_with_icc(image, profile.encode().unwrap())
}

pub(crate) fn png_with_icc(image: &RgbImage, icc: Vec<u8>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut info = png::Info::with_size(image.width(), image.height());
    info.color_type = png::ColorType::Rgb;
    info.bit_depth = png::BitDepth::Eight;
    info.icc_profile = Some(icc.into());
    let encoder = png::Encoder::with_info(&mut bytes, info).unwrap();
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(image.as_raw()).unwrap();
    drop(writer);
    bytes
}

/// Numbers of PNG's chunks gAMA and cHRM.
pub(crate) fn hundred_thousandths(values: &[f64]) -> Vec<u8> {
    values
        .iter()
        .flat_map(|value| ((value * 1e5).round() as u32).to_be_bytes())
        .collect()
}

/// A JPEG with segments behind its first marker.
pub(crate) fn jpeg_with(jpeg: &[u8], segments: &[(u8, Vec<u8>)]) -> Vec<u8> {
    let mut bytes = jpeg[..2].to_vec();
    for (marker, content) in segments {
        bytes.extend([0xff, *marker]);
        bytes.extend((content.len() as u16 + 2).to_be_bytes());
        bytes.extend(content);
    }
    bytes.extend(&jpeg[2..]);
    bytes
}

/// The segments of a profile, of at most so many bytes each.
pub(crate) fn profile_segments(icc: &[u8], most: usize) -> Vec<(u8, Vec<u8>)> {
    let parts = icc.chunks(most);
    let count = parts.len() as u8;
    let segment = |(number, part): (u8, &[u8])| {
        let content = [b"ICC_PROFILE\0", &[number, count][..], part].concat();
        (0xe2, content)
    };
    (1..).zip(parts).map(segment).collect()
}

/// An entry of a TIFF's directory with one short number or a place.
fn entry(tag: u16, kind: u16, count: u32, value: u32) -> Vec<u8> {
    let value = if kind == 3 { value << 16 } else { value };
    [
        &tag.to_be_bytes()[..],
        &kind.to_be_bytes(),
        &count.to_be_bytes(),
        &value.to_be_bytes(),
    ]
    .concat()
}

/// Exif's data with an orientation, a colour space and an index of interoperability.
pub(crate) fn exif(orientation: u8, colour_space: u16, index: &[u8; 4]) -> Vec<u8> {
    let mut bytes = b"MM\0*\0\0\0\x08".to_vec();
    bytes.extend([0, 2]);
    bytes.extend(entry(0x112, 3, 1, orientation.into()));
    bytes.extend(entry(0x8769, 4, 1, 38));
    bytes.extend([0; 4]);
    bytes.extend([0, 2]);
    bytes.extend(entry(0xa001, 3, 1, colour_space.into()));
    bytes.extend(entry(0xa005, 4, 1, 68));
    bytes.extend([0; 4]);
    bytes.extend([0, 1]);
    bytes.extend(entry(1, 2, 4, u32::from_be_bytes(*index)));
    bytes.extend([0; 4]);
    bytes
}

pub(crate) fn exif_segment(exif: Vec<u8>) -> (u8, Vec<u8>) {
    (0xe1, [b"Exif\0\0".to_vec(), exif].concat())
}
