//! Other data sets' folders, and how the files of estimates are encoded.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::path::Path;
use std::process::Command;

use relight_core::files::{write_exr, write_png};
use relight_core::image::{ColourSpace, Depth, Extent, Planes, Srgb, Transfer};
use relight_core::light::{Normals, NormalsFrame, YUp};
use relight_eval::{
    EvalError, IntrinsicBaseline, IntrinsicInput, IntrinsicMethod, NormalMethod, Predictions,
    ScoreTable, evaluate_intrinsic, evaluate_normals,
};
use relight_reader::{TruthLayout, TruthSet};
use relit_data::causes::with_causes;

const EXTENT: Extent = Extent::new(32, 24);

fn albedo() -> Planes<3> {
    Planes::from_fn(EXTENT, |x, y| {
        if x / 5 % 2 == y / 6 % 2 {
            [0.8, 0.4, 0.3]
        } else {
            [0.1, 0.2, 0.5]
        }
    })
}

fn shading() -> Planes<3> {
    Planes::from_fn(EXTENT, |x, y| [0.3 + 0.02 * x as f32 + 0.005 * y as f32; 3])
}

fn picture() -> Planes<3> {
    let (albedo, shading) = (albedo(), shading());
    Planes::from_fn(EXTENT, |x, y| {
        let (a, s) = (albedo.pixel(x, y), shading.pixel(x, y));
        [0, 1, 2].map(|c| a[c] * s[c])
    })
}

fn encoded(planes: Planes<3>) -> Planes<3> {
    planes.map(Srgb::from_linear)
}

fn write_object(folder: &Path, image: &str) {
    fs::create_dir_all(folder).unwrap();
    let mask = Planes::filled(EXTENT, [1.0; 3]);
    let files = [
        ("mask.png", mask),
        (image, picture()),
        ("diffuse.png", picture()),
        ("reflectance.png", albedo()),
        ("shading.png", shading()),
        ("specular.png", Planes::zeros(EXTENT)),
    ];
    for (name, planes) in files {
        write_png(&folder.join(name), &planes, Depth::Sixteen).unwrap();
    }
}

fn evaluated(
    set: &TruthSet,
    found: &Path,
    transfer: Option<Transfer>,
) -> Result<ScoreTable, EvalError> {
    let predictions = Predictions::new(found.to_owned(), transfer, NormalsFrame::YUp);
    let method = IntrinsicMethod::Predictions(predictions);
    evaluate_intrinsic(set, "all", IntrinsicInput::Diffuse, &[method], &|| {})
}

fn worst(table: &ScoreTable) -> f64 {
    let measures = table.lines.iter().flat_map(|line| &line.measures);
    measures.map(|one| one.value).fold(0.0, f64::max)
}

#[test]
fn folders_of_relight_decompose_say_themselves_how_they_are_encoded() {
    let dir = tempfile::tempdir().unwrap();
    let (truth, found) = (dir.path().join("truth"), dir.path().join("net"));
    write_object(&truth.join("cup"), "original.png");
    let cup = found.join("cup");
    fs::create_dir_all(&cup).unwrap();
    write_png(&cup.join("albedo.png"), &encoded(albedo()), Depth::Sixteen).unwrap();
    write_png(
        &cup.join("shading.png"),
        &encoded(shading()),
        Depth::Sixteen,
    )
    .unwrap();
    let set = TruthSet::open(&truth, TruthLayout::Mit).unwrap();
    // Nobody says it: linear, as files of other programs are.
    assert!(worst(&evaluated(&set, &found, None).unwrap()) > 1e-3);
    assert!(worst(&evaluated(&set, &found, Some(Transfer::Srgb)).unwrap()) < 1e-6);
    // As version 0.1 wrote it, and as it is written now.
    for text in [
        r#"{"schema": "relight.decomposition/1"}"#,
        r#"{"schema": "relight.decomposition/1", "transfer": "srgb", "white": {}}"#,
    ] {
        fs::write(cup.join("decomposition.json"), text).unwrap();
        assert!(worst(&evaluated(&set, &found, None).unwrap()) < 1e-6);
        assert!(worst(&evaluated(&set, &found, Some(Transfer::Srgb)).unwrap()) < 1e-6);
        let fault = evaluated(&set, &found, Some(Transfer::Linear)).unwrap_err();
        let text = with_causes(&fault);
        assert!(
            text.contains("decomposition.json says that its files are sRGB"),
            "{text}"
        );
    }
    fs::write(cup.join("decomposition.json"), r#"{"schema": "other/1"}"#).unwrap();
    let text = with_causes(&evaluated(&set, &found, None).unwrap_err());
    assert!(text.contains("other/1"), "{text}");
    fs::write(cup.join("decomposition.json"), "{").unwrap();
    let text = with_causes(&evaluated(&set, &found, None).unwrap_err());
    assert!(text.contains("does not describe"), "{text}");
}

#[test]
fn pictures_of_arap_are_found_with_the_albedo_of_their_scene() {
    let dir = tempfile::tempdir().unwrap();
    let root = dir.path();
    write_exr(&root.join("hall_light0.exr"), &picture()).unwrap();
    write_exr(&root.join("hall_light1.exr"), &picture().map(|v| v * 0.5)).unwrap();
    write_exr(&root.join("hall_albedo.exr"), &albedo()).unwrap();
    let jpeg = root.join("yard.png");
    write_png(&jpeg, &encoded(picture()), Depth::Eight).unwrap();
    write_png(
        &root.join("yard_albedo.png"),
        &encoded(albedo()),
        Depth::Eight,
    )
    .unwrap();
    write_png(
        &root.join("yard_shading.png"),
        &encoded(shading()),
        Depth::Eight,
    )
    .unwrap();
    write_exr(&root.join("nobody.exr"), &picture()).unwrap();
    let set = TruthSet::open(root, TruthLayout::Arap).unwrap();
    let names: Vec<&str> = set.names().collect();
    assert_eq!(names, ["hall_light0", "hall_light1", "yard"]);
    let hall = set.load(1).unwrap();
    assert!(hall.mask.plane(0).iter().all(|&m| m == 1.0));
    // What is not there is the picture over its albedo.
    let found = hall.shading.unwrap().planes().pixel(9, 3);
    let wanted = shading().pixel(9, 3).map(|v| v * 0.5);
    assert!((found[1] - wanted[1]).abs() < 1e-4, "{found:?} {wanted:?}");
    let yard = set.load(2).unwrap();
    let pixel = yard.albedo.unwrap().planes().pixel(1, 1);
    assert!((pixel[0] - albedo().pixel(1, 1)[0]).abs() < 0.01, "sRGB");
    let all = IntrinsicBaseline::all().map(IntrinsicMethod::Baseline);
    let table = evaluate_intrinsic(&set, "all", IntrinsicInput::Diffuse, &all, &|| {}).unwrap();
    assert!(
        table
            .notes
            .iter()
            .any(|note| note.contains("oracle is left out"))
    );
    assert_eq!(table.lines.len(), 5 * 6);
    let empty = TruthSet::open(tempfile::tempdir().unwrap().path(), TruthLayout::Arap);
    assert!(with_causes(&empty.err().unwrap()).contains("_albedo"));
}

/// A file of NumPy, height x width x 3, 32 bits.
fn npy(planes: &Planes<3>) -> Vec<u8> {
    let Extent { width, height } = planes.extent();
    let header =
        format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({height}, {width}, 3), }}\n");
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for y in 0..height {
        for x in 0..width {
            bytes.extend(planes.pixel(x, y).into_iter().flat_map(f32::to_le_bytes));
        }
    }
    bytes
}

#[test]
fn single_images_of_stanford_orb_are_measured_at_their_benchmark_s_size() {
    let dir = tempfile::tempdir().unwrap();
    let (root, found) = (dir.path().join("orb"), dir.path().join("net"));
    // Larger than 512, so that it is brought to that.
    let extent = Extent::new(1024, 1024);
    let block = |x: usize, y: usize| (x / 128 + y / 128) % 2;
    let paint = Planes::from_fn(extent, |x, y| {
        [[0.7, 0.3, 0.2], [0.1, 0.2, 0.6]][block(x, y)]
    });
    let lean = Planes::from_fn(extent, |x, _| {
        let lean = x as f32 / 1024.0 - 0.5;
        [lean, 0.2, (0.96 - lean * lean).sqrt()]
    });
    let scene = "cup_scene001";
    let folders = [
        root.join("blender_LDR").join(scene).join("test"),
        root.join("blender_LDR").join(scene).join("test_mask"),
        root.join("ground_truth").join(scene).join("surface_normal"),
        root.join("ground_truth")
            .join(scene)
            .join("pseudo_gt_albedo"),
    ];
    for folder in &folders {
        fs::create_dir_all(folder).unwrap();
    }
    let [images, masks, normals, albedos] = &folders;
    let image = encoded(paint.clone().map(|v| v * 0.8));
    write_png(&images.join("0003.png"), &image, Depth::Eight).unwrap();
    let mask = Planes::filled(extent, [1.0; 3]);
    write_png(&masks.join("0003.png"), &mask, Depth::Eight).unwrap();
    fs::write(normals.join("0003.npy"), npy(&lean)).unwrap();
    let srgb = encoded(paint.clone());
    write_png(&albedos.join("0003.png"), &srgb, Depth::Eight).unwrap();

    let set = TruthSet::open(&root, TruthLayout::Orb).unwrap();
    assert_eq!(set.names().collect::<Vec<_>>(), ["cup_scene001/0003"]);
    let sample = set.load(0).unwrap();
    assert_eq!(sample.extent(), Extent::new(512, 512));
    assert!(sample.shading.is_none() && sample.diffuse.is_some());

    let out = found.join("cup_scene001/0003");
    fs::create_dir_all(&out).unwrap();
    write_png(&out.join("albedo.png"), &paint, Depth::Sixteen).unwrap();
    let lean = Normals::<YUp>::new(lean);
    lean.write_png(&out.join("normal.png"), Depth::Sixteen)
        .unwrap();
    let table = evaluated(&set, &found, None).unwrap();
    let parts: Vec<&str> = table.lines.iter().map(|line| line.part.as_str()).collect();
    assert_eq!(parts, ["albedo", "albedo"]);
    assert!(worst(&table) < 1e-3, "{table:?}");
    let predictions = Predictions::new(found, None, NormalsFrame::YUp);
    let method = [NormalMethod::Predictions(predictions)];
    let table = evaluate_normals(&set, "all", &method, &|| {}).unwrap();
    let angle = table.lines[0]
        .measures
        .iter()
        .find(|one| one.name == "mean angle");
    assert!(angle.unwrap().value < 0.1, "{table:?}");
}

#[test]
fn the_help_names_all_layouts() {
    let output = Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(["eval", "mit", "--help"])
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    for layout in TruthLayout::ALL {
        assert!(text.contains(layout.name()), "{layout}: {text}");
    }
}
