//! What is in the folder of a decomposition.

use std::fs;

use relight_core::files::read_planes;
use relight_core::image::{Extent, Rgb, Transfer};
use relight_core::light::{Normals, Panorama, ShLight};
use relight_photo::decompose::MaskSource;
use relight_photo::files::PhotoReading;
use relit_test_support::is_named;

use crate::support::{Folder, HEIGHT, WIDTH, load, names_in, object, write};

#[test]
fn a_folder_holds_every_layer_the_light_and_the_figures() {
    let folder = Folder::new();
    let path = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let photo = load(&path, &PhotoReading::default()).unwrap();
    assert_eq!(photo.mask_source, MaskSource::BlackBackground);
    let out = folder.path("sub/cup");
    let found = write(&photo, &out).unwrap();
    let expected = [
        "albedo.png",
        "contact.png",
        "decomposition.json",
        "diffuse.png",
        "light-panorama.exr",
        "light-sphere.png",
        "light.txt",
        "mask.png",
        "normal.png",
        "shading.png",
        "specular.png",
    ];
    assert_eq!(names_in(&out), expected);
    assert_eq!(names_in(&folder.path("sub")), ["cup"]);

    let json = fs::read(out.join("decomposition.json")).unwrap();
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(json["schema"], "relight.decomposition/1");
    assert_eq!(json["mask"]["source"], "black-background");
    assert_eq!(json["size"], serde_json::json!([WIDTH, HEIGHT]));
    assert_eq!(json["light"]["coefficients"].as_array().unwrap().len(), 9);
    assert_eq!(json["specular"]["separated"], true);

    // What the files hold is what was found, in the file's white.
    for (name, layer) in [("albedo", &found.albedo), ("diffuse", &found.diffuse)] {
        let white = json["white"][name].as_f64().unwrap() as f32;
        let file = Rgb::read(&out.join(format!("{name}.png")), Transfer::Srgb).unwrap();
        for (a, b) in file.planes().plane(0).iter().zip(layer.planes().plane(0)) {
            assert!((a * white - b).abs() < 1e-3 * white, "{name}: {a} {b}");
        }
    }
    let normals = Normals::read(&out.join("normal.png")).unwrap();
    let pairs = normals
        .planes()
        .plane(1)
        .iter()
        .zip(found.normals.planes().plane(1));
    assert!(pairs.into_iter().all(|(a, b)| (a - b).abs() < 1e-3));
    assert_eq!(ShLight::read(&out.join("light.txt")).unwrap(), found.light);
    Panorama::read(&out.join("light-panorama.exr")).unwrap();
    let (contact, _) = read_planes(&out.join("contact.png")).unwrap();
    assert_eq!(contact.extent(), Extent::new(4 * 256, 2 * 256));
}

#[test]
fn an_earlier_decomposition_is_replaced_and_nothing_else() {
    let folder = Folder::new();
    let path = folder.save("cup.png", |path| object(0).save(path).unwrap());
    let photo = load(&path, &PhotoReading::default()).unwrap();
    let out = folder.path("out");
    write(&photo, &out).unwrap();
    fs::write(out.join("albedo.png"), "old").unwrap();
    write(&photo, &out).unwrap();
    assert!(fs::read(out.join("albedo.png")).unwrap().len() > 100);

    fs::write(out.join("notes.txt"), "mine").unwrap();
    fs::write(out.join("albedo.png"), "old").unwrap();
    let text = write(&photo, &out).unwrap_err().to_string();
    assert!(is_named(&text, &["out", "notes.txt"]), "{text}");
    assert_eq!(fs::read(out.join("notes.txt")).unwrap(), b"mine");
    assert_eq!(fs::read(out.join("albedo.png")).unwrap(), b"old");
    fs::remove_file(out.join("notes.txt")).unwrap();
    fs::create_dir(out.join("mask.png.d")).unwrap();
    assert!(write(&photo, &out).is_err());

    let foreign = folder.path("foreign");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("albedo.png"), "mine").unwrap();
    let text = write(&photo, &foreign).unwrap_err().to_string();
    assert!(is_named(&text, &["foreign", "albedo.png"]), "{text}");
    assert_eq!(names_in(&foreign), ["albedo.png"]);
    for path in [path.clone(), path.join("in")] {
        let text = write(&photo, &path).unwrap_err().to_string();
        assert!(text.contains("cup.png"), "{text}");
    }
    let empty = folder.path("empty");
    fs::create_dir(&empty).unwrap();
    write(&photo, &empty).unwrap();
    assert_eq!(
        names_in(folder.0.path()),
        ["cup.png", "empty", "foreign", "out"]
    );
}
