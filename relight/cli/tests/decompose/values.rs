//! Photographs of floating point values: other units, and values that are no light.

use std::fs;
use std::path::PathBuf;

use relight_core::files::write_exr;
use relight_core::image::{Extent, Planes, Rgb, Transfer};
use relight_photo::decompose::Photo;
use relit_test_support::is_named;

use crate::support::{Folder, HEIGHT, WIDTH, is_inside, load, mask, with_mask, write};

/// An object of values up to 0.8 before a background of 0.3, times `scale`.
fn light(scale: f32) -> Planes<3> {
    let extent = Extent::new(WIDTH as usize, HEIGHT as usize);
    Planes::from_fn(extent, |x, y| {
        let light = if is_inside(x as u32, y as u32) {
            0.8 * (y + 1) as f32 / HEIGHT as f32
        } else {
            0.3
        };
        [light, 0.8 * light, 0.6 * light].map(|value| scale * value)
    })
}

fn read(folder: &Folder, planes: &Planes<3>) -> Photo {
    let path: PathBuf = folder.save("light.exr", |path| write_exr(path, planes).unwrap());
    let mask = folder.save("mask.png", |path| mask().save(path).unwrap());
    load(&path, &with_mask(mask)).unwrap()
}

fn figures(folder: &Folder) -> serde_json::Value {
    let json = fs::read(folder.path("out/decomposition.json")).unwrap();
    serde_json::from_slice(&json).unwrap()
}

#[test]
fn a_photograph_in_other_units_is_scaled_and_its_maps_with_it() {
    let folder = Folder::new();
    let plain = read(&folder, &light(1.0));
    assert_eq!((plain.scale, plain.notes.len()), (1.0, 0));
    assert_eq!(plain.picture.planes(), &light(1.0));
    write(&plain, &folder.path("out")).unwrap();
    assert_eq!(figures(&folder).get("scale"), None);
    for units in [10.0, 1000.0] {
        let photo = read(&folder, &light(units));
        assert!(is_named(&photo.notes.concat(), &[&photo.scale.to_string()]));
        for (a, b) in [(30, 40), (2, 2)].map(|(x, y)| {
            let was = light(units).pixel(x, y)[0];
            (photo.picture.planes().pixel(x, y)[0], photo.scale * was)
        }) {
            assert!((a - b).abs() < 1e-6, "{units}: {a} {b}");
        }
        // One pixel in a hundred is brighter than 1.
        let brighter = photo.picture.planes().brightest().filter(|&v| v > 1.0);
        let part = brighter.count() as f32 / (WIDTH * HEIGHT) as f32;
        assert!(part <= 0.01, "{units}: {part}");
        let found = write(&photo, &folder.path("out")).unwrap();
        let json = figures(&folder);
        assert_eq!(json["scale"].as_f64().unwrap() as f32, photo.scale);
        let white = json["white"]["diffuse"].as_f64().unwrap() as f32;
        let diffuse = Rgb::read(&folder.path("out/diffuse.png"), Transfer::Srgb).unwrap();
        let [of_file, _, _] = diffuse.planes().pixel(30, 24);
        let [found, _, _] = found.diffuse.planes().pixel(30, 24);
        assert!((of_file * white - found).abs() < 1e-3 * white);
    }
}

#[test]
fn values_that_are_no_light_count_as_black_and_are_counted_also_outside_the_mask() {
    let folder = Folder::new();
    let mut planes = light(1.0);
    planes.set_pixel(1, 1, [f32::NAN; 3]);
    planes.set_pixel(30, 24, [f32::INFINITY, 0.5, 0.5]);
    planes.set_pixel(31, 24, [-0.5, 0.5, 0.5]);
    let photo = read(&folder, &planes);
    assert!(is_named(&photo.notes.concat(), &["4"]), "{:?}", photo.notes);
    let pixel = |x, y| photo.picture.planes().pixel(x, y);
    assert_eq!(pixel(1, 1), [0.0; 3]);
    assert_eq!([pixel(30, 24), pixel(31, 24)], [[0.0, 0.5, 0.5]; 2]);
    assert!(write(&photo, &folder.path("out")).is_ok());
}
