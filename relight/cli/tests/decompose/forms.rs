//! Photographs, masks and folders as other programs leave them.

use std::fs;
use std::io::Cursor;
use std::path::PathBuf;

use exr::prelude::WritableImage;
use image::{DynamicImage, ImageFormat};
use relight_photo::files::{PhotoInput, PhotoList};

use crate::support::{Folder, HEIGHT, WIDTH, is_inside, load, mask, object, with_mask};

fn encoded(format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    DynamicImage::from(object(90))
        .write_to(&mut bytes, format)
        .unwrap();
    bytes.into_inner()
}

#[test]
fn a_jpeg_without_its_end_marker_is_the_same_photograph() {
    let folder = Folder::new();
    let mask = with_mask(folder.save("mask.png", |path| mask().save(path).unwrap()));
    let whole = encoded(ImageFormat::Jpeg);
    let bare = whole.strip_suffix(&[0xff, 0xd9]).unwrap();
    let save = |name: &str, bytes: &[u8]| folder.save(name, |path| fs::write(path, bytes).unwrap());
    let expected = load(&save("a.jpg", &whole), &mask).unwrap().picture;
    for (name, trailer) in [("bare.jpg", &b""[..]), ("trailer.JFIF", b"SEFT and more")] {
        let path = save(name, &[bare, trailer].concat());
        assert_eq!(load(&path, &mask).unwrap().picture, expected, "{name}");
    }
    let cut = save("cut.jpg", &bare[..bare.len() - 40]);
    let fault = load(&cut, &mask).map(|photo| photo.name).unwrap_err();
    assert!(
        fault.to_string().starts_with(cut.to_str().unwrap()),
        "{fault}"
    );
}

#[test]
fn a_mask_in_an_exr_may_have_one_channel() {
    let folder = Folder::new();
    let photo = folder.save("photo.png", |path| object(90).save(path).unwrap());
    let plain = folder.save("mask.png", |path| mask().save(path).unwrap());
    let expected = load(&photo, &with_mask(plain)).unwrap().mask;
    for channel in ["Y", "mask.A"] {
        let exr = folder.save("mask.exr", |path| {
            let values = (0..WIDTH * HEIGHT)
                .map(|at| f32::from(u8::from(is_inside(at % WIDTH, at / WIDTH))));
            let samples = exr::image::FlatSamples::F32(values.collect());
            let channels = exr::image::AnyChannels::sort(
                [exr::image::AnyChannel::new(channel, samples)]
                    .into_iter()
                    .collect(),
            );
            let size = (WIDTH as usize, HEIGHT as usize);
            exr::image::Image::from_channels(size, channels)
                .write()
                .to_file(path)
                .unwrap();
        });
        assert_eq!(
            load(&photo, &with_mask(exr)).unwrap().mask,
            expected,
            "{channel}"
        );
    }
}

#[test]
fn every_file_of_a_folder_is_used_or_named() {
    let folder = Folder::new();
    fs::create_dir(folder.path("photos")).unwrap();
    let write =
        |name: &str, bytes: &[u8]| fs::write(folder.path("photos").join(name), bytes).unwrap();
    let jpeg = encoded(ImageFormat::Jpeg);
    write("a.jpg", &jpeg);
    write("b.jfif", &jpeg);
    write("c.heic", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic");
    write("d.tif", &encoded(ImageFormat::Tiff));
    write("e.JPG", &jpeg);
    // Some telephones call their JPEGs so.
    write("f.heic", &jpeg);
    write("g", &encoded(ImageFormat::Bmp));
    write("h.txt", b"notes");
    // Named, so that reading it says what is wrong.
    write("i.png", b"no picture");
    for left_behind in ["._a.jpg", ".DS_Store", "Thumbs.db", "desktop.ini"] {
        write(left_behind, b"anything");
    }
    for within in ["later", "empty", "done"] {
        fs::create_dir(folder.path("photos").join(within)).unwrap();
    }
    write("later/k.jpg", &jpeg);
    write("done/albedo.png", &jpeg);
    write("done/decomposition.json", b"{}");
    let PhotoList { inputs, unused } = PhotoInput::find(&[folder.path("photos")]).unwrap();
    let used: Vec<String> = inputs.iter().map(PhotoInput::place).collect();
    let name = |path: &str| {
        PathBuf::from(path)
            .file_name()
            .unwrap()
            .to_string_lossy()
            .into_owned()
    };
    let used: Vec<String> = used.iter().map(|path| name(path)).collect();
    assert_eq!(
        used,
        ["a.jpg", "b.jfif", "d.tif", "e.JPG", "f.heic", "g", "i.png"]
    );
    let path = |name: &str| folder.path("photos").join(name);
    let files: Vec<_> = unused.iter().map(|file| file.path.clone()).collect();
    assert_eq!(files, [path("later"), path("c.heic"), path("h.txt")]);
    let message = &unused[1].message;
    assert!(message.contains("HEIC"), "{message}");
}

#[test]
fn a_folder_of_nothing_that_is_read_says_what_it_holds() {
    let folder = Folder::new();
    folder.save("a.cr2", |path| {
        fs::write(path, b"II*\0\x10\0\0\0CR\x02\0").unwrap()
    });
    let fault = PhotoInput::find(&[folder.0.path().to_owned()]).map(|found| found.inputs.len());
    let text = fault.unwrap_err().to_string();
    assert!(text.contains("raw"), "{text}");
}
