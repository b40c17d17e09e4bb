//! What says where the object is.

use std::io::Cursor;

use image::metadata::Orientation;
use image::{
    DynamicImage, GrayImage, ImageBuffer, ImageFormat, Luma, Rgb as Pixel, RgbImage, Rgba,
};
use relight_photo::decompose::{MaskSource, SpecularGate};
use relight_photo::files::PhotoReading;
use relit_data::geometry::Rect;

use crate::support::{Folder, HEIGHT, WIDTH, decomposed, is_inside, load, mask, object, with_mask};

#[test]
fn alpha_is_the_mask_and_what_it_hides_does_not_count() {
    let folder = Folder::new();
    let with_alpha = |hidden: u8| {
        let picture = object(hidden);
        ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| {
            let Pixel([r, g, b]) = *picture.get_pixel(x, y);
            Rgba([r, g, b, if is_inside(x, y) { 255 } else { 0 }])
        })
    };
    let found: Vec<_> = [0, 255]
        .into_iter()
        .map(|hidden| {
            let path = folder.save(&format!("{hidden}.png"), |path| {
                with_alpha(hidden).save(path).unwrap();
            });
            let photo = load(&path, &PhotoReading::default()).unwrap();
            assert_eq!(photo.mask_source, MaskSource::Alpha);
            decomposed(&photo, SpecularGate::Auto).0
        })
        .collect();
    assert_eq!(found[0], found[1]);
}

/// Writes a PNG of 16 bits with what is given as a chunk gAMA.
#[test]
fn a_mask_is_a_files_brightest_channel_or_its_alpha() {
    let folder = Folder::new();
    let photo = folder.save("photo.png", |path| object(90).save(path).unwrap());
    let plain = folder.save("plain.png", |path| mask().save(path).unwrap());
    let wanted = load(&photo, &with_mask(plain)).unwrap().mask;
    let level = |x, y, inside: u8, outside: u8| if is_inside(x, y) { inside } else { outside };
    let blue = folder.save("blue.png", |path| {
        let pixel = |x, y| Pixel([0, 0, level(x, y, 255, 0)]);
        RgbImage::from_fn(WIDTH, HEIGHT, pixel).save(path).unwrap();
    });
    // A dark object that was cut out.
    let cut = folder.save("cut.png", |path| {
        let pixel = |x, y| Rgba([30, 20, 10, level(x, y, 255, 0)]);
        ImageBuffer::from_fn(WIDTH, HEIGHT, pixel)
            .save(path)
            .unwrap();
    });
    let hardly_transparent = folder.save("hardly.png", |path| {
        let pixel = |x, y| {
            let white = level(x, y, 255, 0);
            Rgba([white, white, white, level(x, y, 255, 250)])
        };
        ImageBuffer::from_fn(WIDTH, HEIGHT, pixel)
            .save(path)
            .unwrap();
    });
    for path in [blue, cut, hardly_transparent] {
        let name = path.display().to_string();
        let found = load(&photo, &with_mask(path)).unwrap();
        assert_eq!(found.mask, wanted, "{name}");
    }
}

#[test]
fn masks_of_other_programs_are_read_for_what_they_are() {
    let folder = Folder::new();
    let photo = folder.save("photo.png", |path| object(90).save(path).unwrap());
    let plain = folder.save("plain.png", |path| mask().save(path).unwrap());
    let wanted = load(&photo, &with_mask(plain)).unwrap();
    assert_eq!(wanted.notes.len(), 0);
    let label = folder.save("label.png", |path| {
        let level = |x, y| Luma([u8::from(is_inside(x, y))]);
        GrayImage::from_fn(WIDTH, HEIGHT, level).save(path).unwrap();
    });
    let found = load(&photo, &with_mask(label)).unwrap();
    assert_eq!(found.mask, wanted.mask);
    assert_eq!(found.notes.len(), 1);
    let error = load(&photo, &with_mask(photo.clone())).unwrap_err();
    let name = photo.display().to_string();
    assert!(
        error.to_string().contains(&format!("the mask {name}")),
        "{error}"
    );
}

/// A JPEG of a picture as a camera stores it that is held so that Exif has this orientation.
fn stored(displayed: &RgbImage, orientation: u8) -> Vec<u8> {
    let mut turned = DynamicImage::from(displayed.clone());
    // What takes the orientation back.
    let back = match orientation {
        6 => Orientation::Rotate270,
        8 => Orientation::Rotate90,
        _ => Orientation::Rotate180,
    };
    turned.apply_orientation(back);
    let mut bytes = Cursor::new(Vec::new());
    turned.write_to(&mut bytes, ImageFormat::Jpeg).unwrap();
    let jpeg = bytes.into_inner();
    let exif = [
        b"\xff\xe1\x00\x22Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0".as_slice(),
        &[orientation],
        b"\0\0\0\0\0\0".as_slice(),
    ]
    .concat();
    [&jpeg[..2], &exif, &jpeg[2..]].concat()
}

#[test]
fn a_photograph_that_is_held_otherwise_is_turned_and_a_mask_of_how_it_is_stored_is_told() {
    let folder = Folder::new();
    let displayed = mask_of_displayed(&folder);
    for orientation in [3, 6, 8] {
        let path = folder.save("held.jpg", |path| {
            std::fs::write(path, stored(&object(90), orientation)).unwrap();
        });
        let photo = load(&path, &with_mask(displayed.clone())).unwrap();
        assert_eq!(photo.mask.extent().width, WIDTH as usize, "{orientation}");
        // The object's colours lie under the mask: it is brighter below.
        let [_, _, upper] = photo.picture.planes().pixel(30, 10);
        let [_, _, lower] = photo.picture.planes().pixel(30, 38);
        assert!(lower > upper, "{orientation}: {upper} {lower}");
    }
    // The mask of the picture on its side.
    let side = folder.save("side.png", |path| {
        image::imageops::rotate90(&mask()).save(path).unwrap();
    });
    let held = folder.save("held.jpg", |path| {
        std::fs::write(path, stored(&object(90), 6)).unwrap();
    });
    let error = load(&held, &with_mask(side)).unwrap_err().to_string();
    let sizes = [format!("{HEIGHT} x {WIDTH}"), format!("{WIDTH} x {HEIGHT}")];
    assert!(sizes.iter().all(|size| error.contains(size)), "{error}");
    // More is said than of a mask of just any other size.
    let small = folder.save("small.png", |path| GrayImage::new(8, 8).save(path).unwrap());
    let other = load(&held, &with_mask(small)).unwrap_err().to_string();
    assert_ne!(other.replace("8 x 8", &sizes[0]), error);
}

fn mask_of_displayed(folder: &Folder) -> std::path::PathBuf {
    folder.save("displayed.png", |path| mask().save(path).unwrap())
}

#[test]
fn within_a_rectangle_the_object_is_cut_out_unless_alpha_shows_it() {
    let folder = Folder::new();
    let reading = PhotoReading {
        rectangle: Some(Rect::new(6, 1, 48, 46)),
        ..PhotoReading::default()
    };
    // Also before black, where all that is not black would be the object.
    for grey in [20, 0] {
        let path = folder.save("grey.png", |path| object(grey).save(path).unwrap());
        let photo = load(&path, &reading).unwrap();
        assert_eq!(photo.mask_source, MaskSource::Rectangle);
        let wrong = photo.mask.plane(0).iter().zip(mask().into_raw());
        let wrong = wrong.filter(|(found, wanted)| **found != f32::from(wanted / 255));
        let wrong = wrong.count();
        assert!(wrong < 40, "{grey}: {wrong} of {} pixels", WIDTH * HEIGHT);
    }
}
