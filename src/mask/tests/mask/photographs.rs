//! Photographs as cameras store them: turned by Exif, in folders that are not there yet.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use image::metadata::Orientation;
use image::{DynamicImage, ImageFormat, Rgb, RgbImage};
use serde_json::Value;

use super::support::{code, read, relit_mask, said};

const WIDTH: u32 = 120;
const HEIGHT: u32 = 80;

/// A disc near the upper left corner, on grey that is not quite even.
fn displayed() -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        if (f64::from(x) - 35.0).hypot(f64::from(y) - 30.0) < 16.0 {
            Rgb([220, 120, 40])
        } else {
            Rgb([40 + ((x * 7 + y * 3) % 6) as u8; 3])
        }
    })
}

/// The same as a camera stores it that is held so that Exif has this orientation.
fn stored(orientation: u8, format: ImageFormat) -> Vec<u8> {
    let back = match orientation {
        6 => Orientation::Rotate270,
        8 => Orientation::Rotate90,
        _ => Orientation::Rotate180,
    };
    let mut turned = DynamicImage::from(displayed());
    turned.apply_orientation(back);
    let mut bytes = Cursor::new(Vec::new());
    turned.write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

/// A JPEG's content with Exif's orientation in it.
fn with_exif(jpeg: &[u8], orientation: u8) -> Vec<u8> {
    let mut exif =
        b"\xff\xe1\x00\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".to_vec();
    exif.extend([orientation, 0, 0, 0, 0, 0, 0]);
    [&jpeg[..2], &exif, &jpeg[2..]].concat()
}

fn record_of(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&read(folder, name)).unwrap()
}

#[test]
fn a_photograph_is_masked_as_it_is_displayed_into_a_folder_that_is_made() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for orientation in [1, 3, 6, 8] {
        let jpeg = match orientation {
            1 => {
                let mut bytes = Cursor::new(Vec::new());
                let picture = DynamicImage::from(displayed());
                picture.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
                bytes.into_inner()
            }
            _ => stored(orientation, ImageFormat::Jpeg),
        };
        fs::write(folder.join("held.jpg"), with_exif(&jpeg, orientation)).unwrap();
        let output = format!("masks/{orientation}/held.png");
        let arguments = ["held.jpg", "--rect", "12,8,46,44", "-o", &output];
        let done = relit_mask(folder, &arguments);
        assert_eq!(code(&done), 0, "{orientation}: {}", said(&done));
        let mask = image::load_from_memory(&read(folder, &output))
            .unwrap()
            .into_luma8();
        assert_eq!(mask.dimensions(), (WIDTH, HEIGHT), "{orientation}");
        assert_eq!(mask.get_pixel(35, 30).0, [255], "{orientation}");
        assert_eq!(mask.get_pixel(85, 50).0, [0], "{orientation}");
        let record = record_of(folder, &output.replace(".png", ".json"));
        let noted = record["source"]
            .get("exif_orientation")
            .and_then(Value::as_u64);
        assert_eq!(noted, (orientation > 1).then_some(orientation.into()));
    }
}

#[test]
fn a_webp_is_masked_as_a_jpeg_is() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("cup.webp"), stored(3, ImageFormat::WebP)).unwrap();
    // It lies upside down, and nothing says so.
    let arguments = ["cup.webp", "--rect", "62,28,46,44", "-o", "cup.png"];
    let done = relit_mask(folder, &arguments);
    assert_eq!(code(&done), 0, "{}", said(&done));
    let mask = image::load_from_memory(&read(folder, "cup.png"))
        .unwrap()
        .into_luma8();
    assert_eq!(mask.get_pixel(WIDTH - 36, HEIGHT - 31).0, [255]);
}

/// Adds an orientation to a TIFF.
fn tiff_with_orientation(bytes: Vec<u8>, orientation: u16) -> Vec<u8> {
    let [low, high] = orientation.to_le_bytes();
    tiff_with([0x12, 1, 3, 0, 1, 0, 0, 0, low, high, 0, 0], bytes)
}

/// Adds an entry to a TIFF: another directory behind the file, of the same entries and that.
fn tiff_with(entry: [u8; 12], mut bytes: Vec<u8>) -> Vec<u8> {
    assert_eq!(&bytes[..4], b"II*\0");
    let start = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    let count = usize::from(u16::from_le_bytes(
        bytes[start..start + 2].try_into().unwrap(),
    ));
    let entries = &bytes[start + 2..start + 2 + 12 * count];
    let mut entries: Vec<Vec<u8>> = entries.chunks_exact(12).map(<[u8]>::to_vec).collect();
    entries.push(entry.to_vec());
    entries.sort_by_key(|entry| u16::from_le_bytes([entry[0], entry[1]]));
    bytes.resize(bytes.len().next_multiple_of(2), 0);
    let place = bytes.len() as u32;
    bytes[4..8].copy_from_slice(&place.to_le_bytes());
    bytes.extend((entries.len() as u16).to_le_bytes());
    bytes.extend(entries.concat());
    bytes.extend([0; 4]);
    bytes
}

#[test]
fn a_tiff_is_masked_as_its_tag_turns_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let tiff = tiff_with_orientation(stored(6, ImageFormat::Tiff), 6);
    fs::write(folder.join("scan.tif"), tiff).unwrap();
    let arguments = ["scan.tif", "--rect", "12,8,46,44", "-o", "scan.png"];
    let done = relit_mask(folder, &arguments);
    assert_eq!(code(&done), 0, "{}", said(&done));
    let mask = image::load_from_memory(&read(folder, "scan.png"))
        .unwrap()
        .into_luma8();
    assert_eq!(mask.dimensions(), (WIDTH, HEIGHT));
    assert_eq!(mask.get_pixel(35, 30).0, [255]);
    assert_eq!(
        record_of(folder, "scan.json")["source"]["exif_orientation"],
        6
    );
}

#[test]
fn a_photograph_whose_colours_cannot_be_converted_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut bytes = Vec::new();
    let image = displayed();
    let mut encoder = png::Encoder::new(&mut bytes, image.width(), image.height());
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header().unwrap();
    let points = png::chunk::ChunkType(*b"cICP");
    writer.write_chunk(points, &[9, 16, 0, 1]).unwrap();
    writer.write_image_data(image.as_raw()).unwrap();
    drop(writer);
    fs::write(folder.join("hdr.png"), bytes).unwrap();
    let done = relit_mask(
        folder,
        &["hdr.png", "--rect", "12,8,46,44", "-o", "mask.png"],
    );
    assert_eq!(code(&done), 1, "{}", said(&done));
    assert!(said(&done).contains("PQ"), "{}", said(&done));
}

#[test]
fn a_photograph_in_a_format_that_is_not_read_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Of a raw file FFmpeg would take the small picture for display.
    let small = image::RgbImage::from_pixel(32, 24, Rgb([90; 3]));
    let mut nef = Cursor::new(Vec::new());
    small.write_to(&mut nef, ImageFormat::Tiff).unwrap();
    let nef = tiff_with([0xfe, 0, 4, 0, 1, 0, 0, 0, 1, 0, 0, 0], nef.into_inner());
    let nef = tiff_with([0x0f, 1, 2, 0, 1, 0, 0, 0, 65, 0, 0, 0], nef);
    let nef = tiff_with([0x4a, 1, 4, 0, 1, 0, 0, 0, 8, 0, 0, 0], nef);
    for (name, content, called) in [
        (
            "phone.HEIC",
            &b"\0\0\0\x18ftypheic\0\0\0\0mif1heic"[..],
            "HEIC",
        ),
        ("phone.jpg", b"\0\0\0\x18ftypmif1\0\0\0\0mif1heic", "HEIC"),
        ("canon.cr3", b"\0\0\0\x18ftypcrx \0\0\0\0crx isom", "raw"),
        ("nikon.nef", &nef, "raw"),
        (
            "drawing.svg",
            b"<svg xmlns=\"http://www.w3.org/2000/svg\"/>",
            "SVG",
        ),
        ("layers.xcf", b"gimp xcf v011\0", "GIMP"),
    ] {
        fs::write(folder.join(name), content).unwrap();
        let done = relit_mask(folder, &[name, "--rect", "2,2,20,20", "-o", "mask.png"]);
        assert_eq!(code(&done), 1, "{name}: {}", said(&done));
        let said = said(&done);
        assert!(
            said.contains(name) && said.contains(called),
            "{name}: {said}"
        );
    }
}
