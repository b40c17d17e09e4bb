//! Photographs that cannot be decomposed, and what is said of them.

use std::fs;
use std::fs::File;
use std::io::BufWriter;
use std::path::PathBuf;

use image::{GrayImage, ImageBuffer, Rgb as Pixel, RgbImage};
use relight_photo::decompose::{DecomposeError, DecomposeOptions};
use relight_photo::files::{PhotoInput, PhotoReading};
use relit_data::causes::with_causes;
use relit_data::geometry::Rect;
use relit_test_support::is_named;

use crate::support::{Folder, HEIGHT, WIDTH, load, mask, object, untrained, with_mask};

#[test]
fn an_object_without_light_is_not_decomposed() {
    let folder = Folder::new();
    let black = folder.save("black.png", |path| {
        RgbImage::new(WIDTH, HEIGHT).save(path).unwrap();
    });
    let numberless = folder.save("nan.exr", |path| {
        let nan = ImageBuffer::from_pixel(WIDTH, HEIGHT, Pixel([f32::NAN; 3]));
        image::DynamicImage::ImageRgb32F(nan).save(path).unwrap();
    });
    let mask = folder.save("mask.png", |path| mask().save(path).unwrap());
    let reading = with_mask(mask);
    for path in [black, numberless] {
        let photo = load(&path, &reading).unwrap();
        let found = untrained().decompose(
            &photo.picture,
            &photo.mask,
            &photo.options(&DecomposeOptions::default()),
        );
        assert!(found.unwrap_err().to_string().contains("is black"));
        let found = load(&path, &PhotoReading::default());
        assert!(matches!(found, Err(DecomposeError::Black { .. })));
    }
}

#[test]
fn what_is_wrong_with_a_photograph_is_said_in_a_sentence() {
    let folder = Folder::new();
    let grey = folder.save("grey.png", |path| object(90).save(path).unwrap());
    let black = folder.save("black.png", |path| RgbImage::new(8, 8).save(path).unwrap());
    let small = folder.save("small.png", |path| GrayImage::new(8, 8).save(path).unwrap());
    let none = folder.save("none.png", |path| {
        GrayImage::new(WIDTH, HEIGHT).save(path).unwrap()
    });
    let text = folder.save("text.png", |path| fs::write(path, "hello").unwrap());
    let full = folder.path("full");
    fs::create_dir(&full).unwrap();
    GrayImage::new(WIDTH, HEIGHT)
        .save(full.join("grey.png"))
        .unwrap();
    let cup = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let in_corner = PhotoReading {
        rectangle: Some(Rect::new(0, 0, 2, 2)),
        ..PhotoReading::default()
    };
    let beside = PhotoReading {
        rectangle: Some(Rect::new(100, 0, 5, 5)),
        ..PhotoReading::default()
    };
    let plain = PhotoReading::default();
    for (path, reading, named) in [
        (
            &grey,
            plain.clone(),
            &["grey.png", "relit-mask", "--mask", "--rect"][..],
        ),
        (&black, plain.clone(), &["black.png"]),
        (&cup, in_corner, &["0,0,2,2"]),
        (&grey, with_mask(small), &["8 x 8", "60 x 48"]),
        (&grey, with_mask(none), &["none.png"]),
        (
            &grey,
            with_mask(folder.path("no.png")),
            &["no.png", "(os error 2)"],
        ),
        (&grey, with_mask(full), &["full/grey.png"]),
        (&grey, beside, &["100,0,5,5"]),
        (&text, plain.clone(), &["text.png"]),
        (
            &folder.path("gone.png"),
            plain,
            &["gone.png", "(os error 2)"],
        ),
    ] {
        let error = load(path, &reading).map(|photo| photo.name).unwrap_err();
        let found = with_causes(&error);
        assert!(is_named(&found, named), "{named:?}: {found}");
    }
    let huge = folder.save("huge.png", |path| {
        let file = BufWriter::new(File::create(path).unwrap());
        let encoder = png::Encoder::new(file, 9000, 8000);
        let mut writer = encoder.write_header().unwrap();
        writer.write_chunk(png::chunk::IDAT, &[0x78, 0x9c]).unwrap();
    });
    let error = load(&huge, &PhotoReading::default()).map(|photo| photo.name);
    let text = error.unwrap_err().to_string();
    assert!(is_named(&text, &["9000 x 8000", "64000000"]), "{text}");
    let masks = folder.path("masks");
    fs::create_dir(&masks).unwrap();
    let error = load(&grey, &with_mask(masks.clone())).map(|photo| photo.name);
    assert!(error.unwrap_err().to_string().contains("masks/grey.png"));
    let find = |paths: &[&PathBuf]| {
        let paths: Vec<PathBuf> = paths.iter().map(|path| (*path).clone()).collect();
        PhotoInput::find(&paths).map(|found| found.inputs.len())
    };
    let empty = find(&[&masks]).unwrap_err();
    assert!(is_named(&empty.to_string(), &["masks"]), "{empty}");
    for second in ["grey.jpg", "GREY.png", "Grey.jpg"] {
        let twice = find(&[&grey, &masks.join(second)]).unwrap_err();
        assert!(is_named(&twice.to_string(), &[second]), "{twice}");
    }
}

#[test]
fn a_result_never_has_the_place_of_another_photographs_where_case_is_ignored() {
    let folder = Folder::new();
    for name in ["out", "out/Mug", "out/caf\u{e9}"] {
        fs::create_dir(folder.path(name)).unwrap();
    }
    for name in ["out/mug", "out/MUG", "out/Mug. ", "out/CAFE\u{301}"] {
        let fault = PhotoInput::check_result(&folder.path(name)).unwrap_err();
        assert!(is_named(&fault.to_string(), &[name]), "{fault}");
    }
    for name in ["out/Mug", "out/mug2", "none/mug"] {
        PhotoInput::check_result(&folder.path(name)).unwrap();
    }
}
