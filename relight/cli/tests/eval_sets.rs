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

use relight_core::files::write_png;
use relight_core::image::{ColourSpace, Depth, Extent, Planes, Srgb};
use relight_core::light::NormalsFrame;
use relight_core::reader::{TruthLayout, TruthSet};
use relight_eval::{EvalError, IntrinsicInput, Predictions, ScoreTable, evaluate_intrinsic};
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

fn evaluated(set: &TruthSet, found: &Path) -> Result<ScoreTable, EvalError> {
    let found = [Predictions::new(found.to_owned(), NormalsFrame::YUp)];
    let mut table = evaluate_intrinsic(set, "all", IntrinsicInput::Diffuse, &found, &|_| {})?;
    table.lines.retain(|line| line.method == "net");
    Ok(table)
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
    assert!(worst(&evaluated(&set, &found).unwrap()) > 1e-3);
    let named = Predictions::new(found.clone(), NormalsFrame::YUp);
    assert_eq!(named.undescribed(set.names()), Some(cup.join("albedo.png")));
    let text = r#"{"schema": "relight.decomposition/1", "transfer": "srgb", "white": {}}"#;
    fs::write(cup.join("decomposition.json"), text).unwrap();
    assert!(worst(&evaluated(&set, &found).unwrap()) < 1e-6);
    assert_eq!(named.undescribed(set.names()), None);
    fs::write(cup.join("decomposition.json"), r#"{"schema": "other/1"}"#).unwrap();
    let text = with_causes(&evaluated(&set, &found).unwrap_err());
    assert!(text.contains("other/1"), "{text}");
    fs::write(cup.join("decomposition.json"), "{").unwrap();
    let text = with_causes(&evaluated(&set, &found).unwrap_err());
    assert!(text.contains("decomposition.json"), "{text}");
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
