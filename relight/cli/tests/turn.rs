//! Whole turns from `relight synth sequences`, through the files and the program.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use relight_core::captured_object::CapturedObject;
use relight_core::image::{Linear, Rgb, Transfer};
use relight_core::light::{Normals, ShLight};
use relight_core::metrics::angular_error;
use relight_core::render::Surface;
use relight_synth::{
    Folders, FrameTruth, Library, LightKind, Recipe, SequenceDescription, SequenceRecipe,
    write_sequences,
};
use relight_turn::{
    Elevation, MaterialKind, TableFrame, TableRotation, fit_turn_light, read_curves,
};
use relit_test_support::is_named;

/// The light of this seed is positive on every normal: of others the shading is cut off at 0, which no light of order 2 does.
const SEED: u64 = 8;
const SESSION: &str = "synth-8-0000";

/// A turn in light of order 2 without shadows, and where its truth is.
fn turn(folder: &Path, frames: u32) -> (PathBuf, PathBuf) {
    let recipe = SequenceRecipe {
        recipe: Recipe {
            seed: SEED,
            size: 48,
            light: LightKind::Sh,
            shadows: false,
            ..Recipe::default()
        },
        frames,
    };
    let library = Library::read(&Folders::default()).unwrap();
    write_sequences(&recipe, &library, 1, folder, &|| {}).unwrap();
    (
        folder.join(format!("{SESSION}.tar")),
        folder.join("truth").join(SESSION),
    )
}

/// The elevation, and the light at the angle 0.
fn truth(folder: &Path) -> (f64, ShLight) {
    let json = fs::read(folder.join("turn.json")).unwrap();
    let description: SequenceDescription = serde_json::from_slice(&json).unwrap();
    let [_, y, z] = description.axis;
    let lines = fs::read_to_string(folder.join("frames.jsonl")).unwrap();
    let first: FrameTruth = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    let light = ShLight::new(first.coefficients.to_vec()).unwrap();
    (z.atan2(y).to_degrees(), light)
}

fn surface(folder: &Path) -> Surface {
    let normals = Normals::read(&folder.join("normal.png")).unwrap();
    let albedo = Rgb::<Linear>::read(&folder.join("albedo.png"), Transfer::Linear).unwrap();
    Surface::new(normals, albedo, None).unwrap()
}

fn relight(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(arguments)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// The figures of a run that ended well, but for what it doubts.
fn figures_of(run: &Output) -> serde_json::Value {
    assert!(
        matches!(run.status.code(), Some(0 | 3)),
        "{}",
        text(&run.stderr)
    );
    let line = text(&run.stdout).lines().next().unwrap().to_owned();
    let mut event: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!(event["event"], "turned");
    event["figures"].take()
}

#[test]
fn the_light_of_a_known_surface_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let (shard, truth_folder) = turn(folder.path(), 60);
    let (degrees, light) = truth(&truth_folder);
    let surface = surface(&truth_folder);
    let read = read_curves(&shard, TableRotation::default(), &|_, _| {}).unwrap();
    assert_eq!((read.curves.frames(), read.damage.len()), (60, 0));
    assert!(read.has_angles);
    let elevation = Elevation::measured(degrees).unwrap();
    let frame = TableFrame::new(elevation);
    let solved = fit_turn_light(&read.curves, &surface, MaterialKind::Diffuse, &frame).unwrap();
    let size = |light: &[[f64; 3]]| light.iter().flatten().map(|v| v * v).sum::<f64>().sqrt();
    let difference: Vec<[f64; 3]> = solved
        .coefficients()
        .iter()
        .zip(light.coefficients())
        .map(|(a, b)| [0, 1, 2].map(|c| a[c] - b[c]))
        .collect();
    let relative = size(&difference) / size(light.coefficients());
    // How well the light is known depends on which normals the object has.
    assert!(relative < 0.03, "{relative}");
}

#[test]
fn the_program_writes_a_folder_that_render_takes_and_replaces_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let (shard, _) = turn(folder.path(), 24);
    let out = folder.path().join("solved");
    let arguments = [
        "turn",
        shard.to_str().unwrap(),
        "--json",
        "-o",
        out.to_str().unwrap(),
    ];
    let object = out.join("object.relit");
    // The second run finds the results of the first.
    for _ in 0..2 {
        let figures = figures_of(&relight(&arguments));
        assert_eq!(figures["elevation"]["source"], "assumed");
        assert_eq!(figures["rotation"]["direction"], "counter-clockwise");
        assert_eq!(figures["conditioning"]["coverage_deg"], 360.0);
        assert!(figures["light_source"].is_null());
    }
    let lit = folder.path().join("lit.png");
    let light = out.join("light.txt");
    let run = relight(&[
        "render",
        "image",
        // The folder stands for the object in it.
        out.to_str().unwrap(),
        "--light",
        light.to_str().unwrap(),
        "-o",
        lit.to_str().unwrap(),
    ]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let lit = Rgb::<Linear>::read(&lit, Transfer::Srgb).unwrap();
    assert!(
        lit.planes()
            .planes()
            .iter()
            .any(|plane| plane.iter().any(|&v| v > 0.2))
    );
    let asset = CapturedObject::read(&out).unwrap();
    assert_eq!(asset, CapturedObject::read(&object).unwrap());
    assert!(!asset.surface().normals().is_empty());
    let mut names: Vec<String> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "albedo.png",
        "confidence.png",
        "contact.png",
        "light.txt",
        "mask.png",
        "normal.png",
        "object.relit",
        "shading.png",
        "turn.json",
    ];
    assert_eq!(names, expected);
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    let lit = folder.path().join("lit.png");
    let run = relight(&[
        "render",
        "image",
        "--normals",
        &path("normal.png"),
        "--albedo",
        &path("albedo.png"),
        "--light",
        &path("light.txt"),
        "-o",
        lit.to_str().unwrap(),
    ]);
    assert!(run.status.success(), "{}", text(&run.stderr));
    let foreign = folder.path().join("thesis");
    fs::create_dir(&foreign).unwrap();
    fs::write(foreign.join("thesis.tex"), "").unwrap();
    let mut other = arguments;
    other[4] = foreign.to_str().unwrap();
    let run = relight(&other);
    assert_eq!(run.status.code(), Some(1));
    assert!(is_named(&text(&run.stderr), &["thesis", "thesis.tex"]));
    assert_eq!(fs::read_dir(&foreign).unwrap().count(), 1);
}

#[test]
fn a_known_light_helps() {
    let folder = tempfile::tempdir().unwrap();
    let (shard, truth_folder) = turn(folder.path(), 24);
    let (degrees, light) = truth(&truth_folder);
    let surface = surface(&truth_folder);
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    light.write(Path::new(&path("light.txt"))).unwrap();
    let error = |options: &[&str]| {
        let (shard, out) = (shard.to_str().unwrap(), path("solved"));
        let degrees = degrees.to_string();
        let arguments = ["turn", shard, "--json", "-o", &out, "--elevation", &degrees];
        figures_of(&relight(&[&arguments[..], options].concat()));
        let found = Normals::read(&Path::new(&out).join("normal.png")).unwrap();
        let truth = surface.normals().planes().planes();
        let mask: Vec<bool> = truth[2].iter().map(|&z| z > 0.0).collect();
        let found = found.completed(&mask);
        angular_error(surface.extent(), truth, found.planes().planes(), &mask)
            .unwrap()
            .mean
    };
    let (unknown, known) = (error(&[]), error(&["--light", &path("light.txt")]));
    assert!(known < 0.8 * unknown, "{known} {unknown}");
}

#[test]
fn what_the_data_set_knows_of_the_rig_is_taken_unless_an_option_says_otherwise() {
    let folder = tempfile::tempdir().unwrap();
    let (shard, _) = turn(folder.path(), 24);
    let description = folder.path().join("dataset.json");
    let json = fs::read(&description).unwrap();
    let mut dataset: serde_json::Value = serde_json::from_slice(&json).unwrap();
    dataset["sessions"][0]["rig"] =
        serde_json::json!({ "rotation": "clockwise", "camera_elevation_deg": 25.5 });
    fs::write(&description, dataset.to_string()).unwrap();
    let out = folder.path().join("solved");
    let solve = |options: &[&str]| {
        let (shard, out) = (shard.to_str().unwrap(), out.to_str().unwrap());
        let arguments = ["turn", shard, "--json", "-o", out];
        let figures = figures_of(&relight(&[&arguments[..], options].concat()));
        let of = |name: &str, value: &str| {
            (
                figures[name][value].clone(),
                figures[name]["source"].clone(),
            )
        };
        (of("elevation", "degrees"), of("rotation", "direction"))
    };
    let said = |value: serde_json::Value, source: &str| (value, serde_json::json!(source));
    let (elevation, rotation) = solve(&[]);
    assert_eq!(elevation, said(25.5.into(), "rig"));
    assert_eq!(rotation, said("clockwise".into(), "rig"));
    let options = ["--elevation", "20", "--rotation", "counter-clockwise"];
    let (elevation, rotation) = solve(&options);
    assert_eq!(elevation, said(20.0.into(), "given"));
    assert_eq!(rotation, said("counter-clockwise".into(), "given"));
}

#[test]
fn places_that_cannot_be_written_are_told_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    fs::create_dir(folder.path().join("thesis")).unwrap();
    fs::write(folder.path().join("thesis/thesis.tex"), "").unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    // The shard is not there: were it read first, this would be what is told.
    let shard = path("missing.tar");
    for place in ["thesis", "file"] {
        let run = relight(&["turn", &shard, "-o", &path(place)]);
        assert_eq!(run.status.code(), Some(1), "{place}");
        let said = text(&run.stderr);
        assert!(said.contains(&path(place)), "{place}: {said}");
        assert!(!said.contains("missing.tar"), "{place}: {said}");
    }
    let mut names: Vec<_> = fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name())
        .collect();
    names.sort();
    assert_eq!(names, ["file", "thesis"]);
}

#[test]
fn a_damaged_frame_is_named_and_the_rest_is_solved() {
    let folder = tempfile::tempdir().unwrap();
    let (shard, _) = turn(folder.path(), 24);
    let mut bytes = fs::read(&shard).unwrap();
    let png = bytes.windows(4).position(|four| four == b"IDAT").unwrap();
    bytes[png + 20..png + 60].fill(0);
    fs::write(&shard, &bytes).unwrap();
    let out = folder.path().join("solved");
    let run = relight(&[
        "turn",
        shard.to_str().unwrap(),
        "--elevation",
        "20",
        "-o",
        out.to_str().unwrap(),
    ]);
    assert_eq!(run.status.code(), Some(3), "{}", text(&run.stderr));
    assert!(
        text(&run.stderr).contains("sample 0"),
        "{}",
        text(&run.stderr)
    );
    assert!(out.join("normal.png").is_file());
}

#[test]
fn wrong_usage_exits_with_2() {
    let run = relight(&["turn", "a.tar", "--elevation", "95", "-o", "out"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(text(&run.stderr).contains("89"));
    let run = relight(&["turn", "a.tar", "--rotation", "left", "-o", "out"]);
    assert_eq!(run.status.code(), Some(2));
    let lone = ["turn", "a.tar", "-o", "out", "--session", "mug"];
    assert_eq!(relight(&lone).status.code(), Some(2));
    for ball in ["90,80", "90,80,1", "90,80,20,wood"] {
        let run = relight(&[
            "turn",
            "a.tar",
            "-o",
            "out",
            "--session",
            "mug",
            "--light-ball",
            ball,
        ]);
        assert_eq!(run.status.code(), Some(2), "{ball}");
    }
}

#[test]
fn a_photograph_is_no_turn() {
    let folder = tempfile::tempdir().unwrap();
    let photo = folder.path().join("photo.jpg");
    fs::write(&photo, [0xff; 2000]).unwrap();
    let run = relight(&["turn", photo.to_str().unwrap(), "-o", "missing"]);
    assert_eq!(run.status.code(), Some(1));
    assert!(
        text(&run.stderr).contains("photo.jpg"),
        "{}",
        text(&run.stderr)
    );
}

#[test]
fn several_turns_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (shard, _) = turn(folder.path(), 12);
    fs::copy(&shard, folder.path().join("again.tar")).unwrap();
    fs::remove_file(folder.path().join("dataset.json")).unwrap();
    let error = read_curves(folder.path(), TableRotation::default(), &|_, _| {}).unwrap_err();
    assert!(error.to_string().contains("holds 2 turns"), "{error}");
}
