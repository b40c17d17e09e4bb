//! How the values of files are encoded.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use image::{ImageBuffer, Rgb as Pixel};
use relight_core::image::Transfer;
use relight_photo::decompose::DecomposeError;
use relight_photo::files::PhotoReading;

use crate::support::{Folder, HEIGHT, WIDTH, load, mask, object, with_mask};

fn write_gamma(path: &Path, values: &[u16], gamma: f32) {
    let file = BufWriter::new(File::create(path).unwrap());
    let mut encoder = png::Encoder::new(file, WIDTH, HEIGHT);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.set_source_gamma(png::ScaledFloat::new(gamma));
    let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_be_bytes()).collect();
    encoder
        .write_header()
        .unwrap()
        .write_image_data(&bytes)
        .unwrap();
}

#[test]
fn a_file_says_itself_whether_it_is_linear() {
    let folder = Folder::new();
    let mask = folder.save("mask.png", |path| mask().save(path).unwrap());
    let values = vec![0x8000_u16; (3 * WIDTH * HEIGHT) as usize];
    let value = |gamma: f32, transfer: Option<Transfer>| {
        let path = folder.save("photo.png", |path| write_gamma(path, &values, gamma));
        let reading = PhotoReading {
            transfer,
            ..with_mask(mask.clone())
        };
        Ok::<f32, DecomposeError>(load(&path, &reading)?.picture.planes().plane(0)[0])
    };
    assert!((value(1.0, None).unwrap() - 0.5).abs() < 1e-4);
    assert!((value(1.0 / 2.2, None).unwrap() - 0.2140).abs() < 1e-3);
    assert!((value(1.0, Some(Transfer::Srgb)).unwrap() - 0.2140).abs() < 1e-3);
    assert!((value(1.0, Some(Transfer::Gamma22)).unwrap() - 0.2176).abs() < 1e-3);
    assert!((value(1.0 / 1.8, None).unwrap() - 0.2872).abs() < 1e-3);
    let fault = value(1e-4, None).unwrap_err();
    assert!(fault.to_string().contains("--transfer"), "{fault}");

    let exr = folder.save("photo.exr", |path| {
        // Less than half of it is brighter than white.
        let bright = ImageBuffer::from_fn(WIDTH, HEIGHT, |x, _| {
            Pixel([if x < 9 { 3.0_f32 } else { 0.9 }, 0.5, 0.25])
        });
        image::DynamicImage::ImageRgb32F(bright).save(path).unwrap();
    });
    let photo = load(&exr, &with_mask(mask)).unwrap();
    assert_eq!(photo.picture.planes().pixel(5, 5), [3.0, 0.5, 0.25]);
}

#[test]
fn a_png_of_high_dynamic_range_is_not_taken_for_srgb() {
    let folder = Folder::new();
    let mask = folder.save("mask.png", |path| mask().save(path).unwrap());
    let load = |function: u8, transfer: Option<Transfer>| {
        let path = folder.save("photo.png", |path| {
            let file = BufWriter::new(File::create(path).unwrap());
            let mut encoder = png::Encoder::new(file, WIDTH, HEIGHT);
            encoder.set_color(png::ColorType::Rgb);
            let mut writer = encoder.write_header().unwrap();
            let points = [1, function, 0, 1];
            let cicp = png::chunk::ChunkType(*b"cICP");
            writer.write_chunk(cicp, &points).unwrap();
            writer.write_image_data(object(0).as_raw()).unwrap();
        });
        let reading = PhotoReading {
            transfer,
            ..with_mask(mask.clone())
        };
        load(&path, &reading).map(|photo| photo.picture.planes().pixel(30, 24)[0])
    };
    let srgb = load(13, None).unwrap();
    assert!(load(8, None).unwrap() > 1.2 * srgb);
    for (function, name) in [(16, "PQ"), (18, "HLG"), (9, "logarithm"), (77, "unknown")] {
        let text = load(function, None).unwrap_err().to_string();
        assert!(text.contains(name) && text.contains("--transfer"), "{text}");
        assert_eq!(load(function, Some(Transfer::Srgb)).unwrap(), srgb);
    }
    for same in [1, 2] {
        assert_eq!(load(same, None).unwrap(), srgb);
    }
}
