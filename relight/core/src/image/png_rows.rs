//! PNGs whose pixels are computed some rows at a time: a large picture is never in memory as integers.

use std::path::Path;

use super::codec::to_integer;
use super::{Depth, Extent, ImageError, Planes};
use crate::parallel;

/// Rows that are computed in parallel.
const ROWS: usize = 64;

/// Values of 0 to 1 as integers in a PNG; others are clipped.
///
/// # Errors
/// If the picture, called `path`, cannot be encoded.
pub fn encode_png(path: &Path, planes: &Planes<3>, depth: Depth) -> Result<Vec<u8>, ImageError> {
    let [red, green, blue] = planes.planes();
    encode_png_of(path, planes.extent(), depth, |at| {
        [red[at], green[at], blue[at]]
    })
}

/// The same of a picture whose pixels are computed: `pixel` is given a row's number times the width, plus the column's.
///
/// # Errors
/// If the picture, called `path`, cannot be encoded.
pub fn encode_png_of(
    path: &Path,
    extent: Extent,
    depth: Depth,
    pixel: impl Fn(usize) -> [f32; 3] + Sync,
) -> Result<Vec<u8>, ImageError> {
    write_rows(extent, depth, pixel).map_err(ImageError::encode(path))
}

fn write_rows(
    extent: Extent,
    depth: Depth,
    pixel: impl Fn(usize) -> [f32; 3] + Sync,
) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    let [width, height] = extent.sides();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(match depth {
        Depth::Eight => png::BitDepth::Eight,
        Depth::Sixteen => png::BitDepth::Sixteen,
    });
    // The default level takes twenty times as long, and files are no smaller.
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    for first in (0..extent.height).step_by(ROWS) {
        let count = ROWS.min(extent.height - first);
        let rows = parallel::map(count, |row| {
            let begin = (first + row) * extent.width;
            let pixels = (begin..begin + extent.width).map(&pixel);
            packed(pixels, depth)
        });
        for row in rows {
            std::io::Write::write_all(&mut stream, &row)?;
        }
    }
    stream.finish()?;
    writer.finish()?;
    Ok(bytes)
}

/// Integers as a PNG holds them, the high byte first.
fn packed(pixels: impl Iterator<Item = [f32; 3]>, depth: Depth) -> Vec<u8> {
    match depth {
        Depth::Eight => pixels
            .flatten()
            .map(|v| to_integer(v, 255.0) as u8)
            .collect(),
        Depth::Sixteen => pixels
            .flatten()
            .flat_map(|v| (to_integer(v, 65535.0) as u16).to_be_bytes())
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::StoredImage;

    #[test]
    fn pictures_of_more_rows_than_are_computed_at_once_come_back() {
        let extent = Extent::new(5, 2 * ROWS + 3);
        let planes = Planes::from_fn(extent, |x, y| [x as f32 / 4.0, y as f32 / 130.0, 0.25]);
        for (depth, steps) in [(Depth::Eight, 255.0), (Depth::Sixteen, 65535.0)] {
            let bytes = encode_png(Path::new("a.png"), &planes, depth).unwrap();
            let back = StoredImage::from_bytes(Path::new("a.png"), &bytes).unwrap();
            for (a, b) in planes.planes().into_iter().zip(back.planes.planes()) {
                let most = a.iter().zip(b).map(|(a, b)| (a - b).abs());
                assert!(most.fold(0.0, f32::max) <= 0.51 / steps, "{depth:?}");
            }
        }
    }

    #[test]
    fn a_picture_without_pixels_is_an_error() {
        let none = Planes::zeros(Extent::new(0, 4));
        assert!(encode_png(Path::new("a.png"), &none, Depth::Eight).is_err());
    }
}
