//! What is written, read back by readers of others.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::path::Path;

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Planes, Rgb};
use relight_core::light::Normals;
use relight_core::render::{Gloss, Surface};
use relight_photo::export::{ObjectMesh, read_object, to_glb, to_layers};

/// A ball of an albedo, glossy if asked for.
fn ball(side: usize, is_glossy: bool) -> CapturedObject {
    let normals = Normals::sphere(side);
    let extent = normals.extent();
    let alpha = Planes::from_fn(extent, |x, y| {
        [f32::from(u8::from(normals.planes().pixel(x, y)[2] > 0.0))]
    });
    let albedo = Rgb::new(Planes::filled(extent, [0.6, 0.3, 0.1]));
    let gloss = is_glossy.then(|| Gloss::even(extent, [0.5; 3], 30.0));
    let surface = Surface::new(normals, albedo, gloss).unwrap();
    CapturedObject::new("ball", surface, alpha.clone(), alpha).unwrap()
}

fn glb(object: &CapturedObject) -> gltf::Gltf {
    let mesh = ObjectMesh::from_object(object, 64).unwrap();
    gltf::Gltf::from_slice(&to_glb(object, &mesh).unwrap()).unwrap()
}

#[test]
fn a_glb_has_the_object_s_size_normals_and_material() {
    let read = glb(&ball(64, true));
    let primitive = read.meshes().next().unwrap().primitives().next().unwrap();
    let [x, _, z] = primitive.bounding_box().max;
    assert!(
        (x - 0.5).abs() < 0.05 && (z - 0.425).abs() < 0.04,
        "{x} {z}"
    );
    let json = &read.document.as_json().extensions_used;
    assert_eq!(json, &["KHR_materials_specular"]);
    let blob = read.blob.as_deref().unwrap();
    let picture = |index: usize| {
        let gltf::image::Source::View { view, .. } = read.images().nth(index).unwrap().source()
        else {
            panic!("a picture outside of the file");
        };
        image::load_from_memory(&blob[view.offset()..view.offset() + view.length()])
            .unwrap()
            .to_rgba8()
    };
    // The middle faces the viewer; to the right normals lean to the right, above upwards.
    let normals = picture(1);
    assert_eq!(normals.get_pixel(32, 32).0[2], 255);
    assert!(normals.get_pixel(56, 32).0[0] > 200 && normals.get_pixel(32, 8).0[1] > 200);
    let colours = picture(0);
    assert_eq!(
        (colours.get_pixel(0, 0).0[3], colours.get_pixel(32, 32).0[3]),
        (0, 255)
    );
    // sRGB of 0.6, 0.3, 0.1.
    assert_eq!(colours.get_pixel(32, 32).0[..3], [203, 149, 89]);
    let roughness = f64::from(picture(2).get_pixel(32, 32).0[1]) / 255.0;
    assert!((roughness - (2.0_f64 / 32.0).powf(0.25)).abs() < 0.01);
}

#[test]
fn a_diffuse_object_reflects_nothing() {
    let read = glb(&ball(16, false));
    let material = read.materials().next().unwrap();
    assert_eq!(material.pbr_metallic_roughness().roughness_factor(), 1.0);
    assert_eq!(read.images().count(), 2);
}

#[test]
fn an_exr_has_all_maps_as_layers() {
    use exr::prelude::{ReadChannels, ReadLayers, read};
    let bytes = to_layers(&ball(32, true)).unwrap();
    let image = read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(bytes))
        .unwrap();
    let channels = &image.layer_data.channel_data.list;
    let value = |name: &str, at: usize| {
        let found = channels.iter().find(|channel| channel.name == *name);
        found.unwrap().sample_data.values_as_f32().nth(at).unwrap()
    };
    let middle = 16 * 32 + 16;
    assert_eq!(channels.len(), 16);
    assert!((value("albedo.R", middle) - 0.6).abs() < 1e-6);
    assert_eq!(value("R", 0), 0.0);
    assert_eq!(value("smoothness.Y", middle), 30.0);
    assert!(value("normal.Z", middle) > 0.99);
    assert!((10.0..16.0).contains(&value("height.Z", middle)));
}

#[test]
fn an_object_is_read_from_a_file_or_a_folder_and_from_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let object = ball(24, true);
    let file = folder.path().join("object.relit");
    object.write(&file).unwrap();
    assert_eq!(
        read_object(&file).unwrap(),
        read_object(folder.path()).unwrap()
    );
    let empty = tempfile::tempdir().unwrap();
    let error = read_object(empty.path()).unwrap_err();
    assert!(error.to_string().contains("holds no object"), "{error}");
    for missing in ["missing.relit", "missing"] {
        let error = read_object(&empty.path().join(missing)).unwrap_err();
        assert!(error.to_string().contains("does not exist"), "{error}");
    }
}

/// The maps of a decomposition as `relight decompose` writes them.
fn write_decomposition(folder: &Path) {
    use relight_core::files::write_png;
    use relight_core::image::{Depth, Srgb};
    let object = ball(24, false);
    let normals = object.surface().normals();
    normals
        .write_png(&folder.join("normal.png"), Depth::Sixteen)
        .unwrap();
    let albedo = object.surface().albedo().clone().encode::<Srgb>();
    write_png(&folder.join("albedo.png"), albedo.planes(), Depth::Sixteen).unwrap();
    let alpha = object.alpha().plane(0).to_vec();
    let mask = Planes::from_planes(object.extent(), [alpha.clone(), alpha.clone(), alpha]);
    write_png(&folder.join("mask.png"), &mask.unwrap(), Depth::Eight).unwrap();
}

#[test]
fn a_decomposition_has_the_brightness_that_its_figures_say() {
    let folder = tempfile::tempdir().unwrap();
    write_decomposition(folder.path());
    let figures = folder.path().join("decomposition.json");
    let json = r#"{"white": {"albedo": 2.0}, "specular": {"reflectance": 0.4, "smoothness": 20}}"#;
    std::fs::write(&figures, json).unwrap();
    let object = read_object(folder.path()).unwrap();
    let albedo = object.surface().albedo().planes().pixel(12, 12);
    assert!((albedo[0] - 1.2).abs() < 1e-3, "{albedo:?}");
    assert_eq!(
        object.surface().gloss().unwrap().smoothness().pixel(12, 12),
        [20.0]
    );
    std::fs::write(&figures, r#"{"white": {"albedo": -1}}"#).unwrap();
    let error = read_object(folder.path()).unwrap_err();
    assert!(error.to_string().contains("white.albedo"), "{error}");
}
