//! What is written can be read, and what cannot be read is refused by name.

use std::io::{Cursor, Read, Write};

use relit_data::causes::with_causes;
use zip::write::SimpleFileOptions;
use zip::{ZipArchive, ZipWriter};

use super::manifest::MANIFEST;
use super::*;
use crate::image::{Extent, Planes, Rgb};
use crate::light::Normals;
use crate::render::{Gloss, Surface};

fn ball(gloss: bool) -> CapturedObject {
    let normals = Normals::sphere(12);
    let extent = normals.extent();
    let albedo = Planes::from_fn(extent, |x, y| [0.1 * x as f32, 0.05 * y as f32, 1.7]);
    let gloss = gloss.then(|| Gloss::even(extent, [0.04, 0.05, 0.06], 80.0));
    let surface = Surface::new(normals, Rgb::new(albedo), gloss).unwrap();
    let alpha = Planes::from_fn(extent, |x, _| [x as f32 / 11.0]);
    let confidence = Planes::from_fn(extent, |_, y| [y as f32 / 11.0]);
    CapturedObject::new("a ball", surface, alpha, confidence).unwrap()
}

/// The archive with one entry replaced, or left out.
fn changed(object: &CapturedObject, name: &str, content: Option<&[u8]>) -> Vec<u8> {
    let bytes = object.to_bytes().unwrap();
    let mut old = ZipArchive::new(Cursor::new(bytes)).unwrap();
    let mut new = ZipWriter::new(Cursor::new(Vec::new()));
    for at in 0..old.len() {
        let mut entry = old.by_index(at).unwrap();
        let mut stored = Vec::new();
        entry.read_to_end(&mut stored).unwrap();
        let called = entry.name().unwrap().into_owned();
        let stored = if called == name {
            content
        } else {
            Some(stored.as_slice())
        };
        if let Some(stored) = stored {
            let options =
                SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
            new.start_file(called, options).unwrap();
            new.write_all(stored).unwrap();
        }
    }
    new.finish().unwrap().into_inner()
}

fn refusal(bytes: &[u8]) -> String {
    with_causes(&CapturedObject::from_bytes(bytes).unwrap_err())
}

fn near<const C: usize>(a: &Planes<C>, b: &Planes<C>, within: f32) {
    for (a, b) in a.planes().into_iter().zip(b.planes()) {
        assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= within));
    }
}

#[test]
fn an_object_comes_back_from_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ball.relit");
    for gloss in [false, true] {
        let object = ball(gloss);
        object.write(&path).unwrap();
        let back = CapturedObject::read(&path).unwrap();
        assert_eq!(back.name(), "a ball");
        near(back.alpha(), object.alpha(), 1e-5);
        near(back.confidence(), object.confidence(), 1e-5);
        let (found, made) = (back.surface(), object.surface());
        near(found.normals().planes(), made.normals().planes(), 1e-4);
        near(found.albedo().planes(), made.albedo().planes(), 2e-5);
        assert_eq!(found.gloss().is_some(), gloss);
        if let (Some(found), Some(made)) = (found.gloss(), made.gloss()) {
            near(found.reflectance(), made.reflectance(), 1e-5);
            near(found.smoothness(), made.smoothness(), 1e-2);
        }
    }
}

#[test]
fn writing_twice_gives_the_same_bytes() {
    assert_eq!(
        ball(true).to_bytes().unwrap(),
        ball(true).to_bytes().unwrap()
    );
}

#[test]
fn what_is_no_object_is_refused_with_what_is_wrong() {
    let object = ball(true);
    assert!(refusal(b"no archive at all").contains("ZIP"));
    let later = br#"{"schema": "relight.asset/2", "shape": "mesh"}"#;
    assert!(refusal(&changed(&object, MANIFEST, Some(later))).contains("relight.asset/2"));
    assert!(refusal(&changed(&object, MANIFEST, None)).contains("asset.json"));
    assert!(refusal(&changed(&object, "alpha.png", None)).contains("alpha.png"));
    assert!(refusal(&changed(&object, "smoothness.png", None)).contains("smoothness.png"));
    assert!(refusal(&changed(&object, "normal.png", Some(b"text"))).contains("normal.png"));
    let bytes = object.to_bytes().unwrap();
    assert!(CapturedObject::from_bytes(&bytes[..bytes.len() / 2]).is_err());
}

#[test]
fn sizes_that_cannot_be_are_refused_before_anything_is_decoded() {
    let object = ball(false);
    let manifest = |width: u64, white: &str| {
        format!(
            r#"{{"schema": "relight.asset/1", "name": "", "width": {width}, "height": 12, "white": {white}}}"#
        )
    };
    let whole = r#"{"albedo": 1.0}"#;
    for width in [0, 9000, u64::MAX] {
        let json = manifest(width, whole);
        let refused = refusal(&changed(&object, MANIFEST, Some(json.as_bytes())));
        assert!(
            refused.contains("16777216") || refused.contains("asset.json"),
            "{refused}"
        );
    }
    let json = manifest(8000, whole);
    let refused = refusal(&changed(&object, MANIFEST, Some(json.as_bytes())));
    assert!(refused.contains("12 x 12"), "{refused}");
    let json = manifest(12, r#"{"albedo": -1.0}"#);
    let refused = refusal(&changed(&object, MANIFEST, Some(json.as_bytes())));
    assert!(refused.contains("white.albedo"), "{refused}");
    let long = vec![b' '; 70_000];
    assert!(refusal(&changed(&object, MANIFEST, Some(&long))).contains("65536"));
}

#[test]
fn maps_of_other_sizes_make_no_object() {
    let object = ball(false);
    let small = Planes::filled(Extent::new(2, 2), [1.0]);
    let refused = CapturedObject::new(
        "",
        object.surface().clone(),
        small,
        object.confidence().clone(),
    );
    let refused = refused.unwrap_err();
    assert!(refused.to_string().contains("coverage"), "{refused}");
}
