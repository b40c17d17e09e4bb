//! Whole turns from `relight synth --turn`, through the files and the program.
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
use relight_core::image::{Linear, Planes, Rgb, Transfer};
use relight_core::light::NormalsFrame;
use relight_core::light::{Normals, Order, ShLight, YUp};
use relight_core::metrics::{Comparison, ScaleFit, angular_error};
use relight_core::reader::{TruthLayout, TruthSet};
use relight_core::render::Surface;
use relight_photo::nets::{NetError, Weights, decomposer};
use relight_synth::{
    Folders, FrameTruth, Library, LightKind, Recipe, TurnDescription, TurnRecipe, write_turns,
};
use relight_turn::{
    Elevation, MaterialKind, NormalsSource, TableFrame, TableRotation, TurnError, TurnOptions,
    fit_turn_light, prior_normals, read_curves, solve_turn,
};

/// The light of this seed is positive on every normal: of others the shading is cut off at 0, which no light of order 2 does.
const SEED: u64 = 8;
const SESSION: &str = "synth-8-0000";

/// A turn in light of order 2 without shadows, and where its truth is.
fn turn(folder: &Path, frames: u32) -> (PathBuf, PathBuf) {
    let recipe = TurnRecipe {
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
    write_turns(&recipe, &library, 1, folder, &|| {}).unwrap();
    (
        folder.join(format!("{SESSION}.tar")),
        folder.join("truth").join(SESSION),
    )
}

/// The elevation, and the light at the angle 0.
fn truth(folder: &Path) -> (f64, ShLight) {
    let json = fs::read(folder.join("turn.json")).unwrap();
    let description: TurnDescription = serde_json::from_slice(&json).unwrap();
    let [_, y, z] = description.axis;
    let lines = fs::read_to_string(folder.join("frames.jsonl")).unwrap();
    let first: FrameTruth = serde_json::from_str(lines.lines().next().unwrap()).unwrap();
    let light = ShLight::new(first.coefficients.to_vec()).unwrap();
    (z.atan2(y).to_degrees(), light)
}

fn surface(folder: &Path) -> Surface {
    let normals = Normals::<YUp>::read(&folder.join("normal.png")).unwrap();
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

#[test]
fn a_turn_in_light_of_order_two_gives_normals_albedo_and_light_back() {
    let folder = tempfile::tempdir().unwrap();
    let (shard, truth_folder) = turn(folder.path(), 60);
    let (degrees, light) = truth(&truth_folder);
    let surface = surface(&truth_folder);
    let read = read_curves(&shard, TableRotation::default(), &|_, _| {}).unwrap();
    assert_eq!((read.curves.frames(), read.damage.len()), (60, 0));
    assert!(read.has_angles);
    let options = TurnOptions {
        elevation: Elevation::given(degrees).unwrap(),
        light: Some(light.clone()),
        ..TurnOptions::default()
    };
    let found = solve_turn(&read.curves, &options).unwrap();
    let mask: Vec<bool> = read.mask.plane(0).iter().map(|&m| m >= 0.5).collect();
    let normals = found.normals(&read.curves);
    let error = angular_error(
        surface.extent(),
        surface.normals().planes().planes(),
        normals.planes().planes(),
        &mask,
    )
    .unwrap();
    assert!(error.mean < 1.0, "{error:?}");
    let albedo = found.albedo(&read.curves);
    let (truth, found) = (surface.albedo().planes(), albedo.planes());
    let pair = Comparison::new(surface.extent(), &truth.planes(), &found.planes(), &mask).unwrap();
    let black = Planes::<3>::zeros(surface.extent());
    let own = Comparison::new(surface.extent(), &truth.planes(), &black.planes(), &mask).unwrap();
    let relative = (pair.mse(ScaleFit::None) / own.mse(ScaleFit::None)).sqrt();
    assert!(relative < 0.01, "{relative}");
    let frame = TableFrame::new(Elevation::given(degrees).unwrap());
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
    let (shard, truth_folder) = turn(folder.path(), 24);
    let out = folder.path().join("solved");
    let normals = truth_folder.join("normal.png");
    let arguments = [
        "turn",
        shard.to_str().unwrap(),
        "--normals",
        normals.to_str().unwrap(),
        "--no-video",
        "--json",
        "-o",
        out.to_str().unwrap(),
    ];
    let object = out.join("object.relit");
    let labels = folder.path().join("labels");
    let mut more = arguments.to_vec();
    more.extend(["--asset", object.to_str().unwrap()]);
    more.extend(["--labels", labels.to_str().unwrap()]);
    // The third run finds the object of the second among its results.
    for arguments in [&arguments[..], &more, &more] {
        let run = relight(arguments);
        assert!(run.status.success(), "{}", text(&run.stderr));
        assert!(text(&run.stderr).contains("elevation is not known"));
        let event: serde_json::Value =
            serde_json::from_str(text(&run.stdout).lines().next().unwrap()).unwrap();
        assert_eq!(event["event"], "turned");
        assert_eq!(event["figures"]["elevation"]["source"], "assumed");
        assert_eq!(event["figures"]["rotation"]["source"], "assumed");
        assert!(event["figures"]["ambiguity"].is_null());
    }
    let taken_for = |name: &str| {
        let mut other = arguments.to_vec();
        other.extend(["--asset", name]);
        let run = relight(&other);
        assert_eq!(run.status.code(), Some(1));
        assert!(text(&run.stderr).contains("give a name that ends in .relit"));
    };
    let before = fs::read(&shard).unwrap();
    taken_for(shard.to_str().unwrap());
    assert!(fs::read(&shard).unwrap() == before);
    let lit = folder.path().join("lit.png");
    let light = out.join("light.txt");
    let run = relight(&[
        "render",
        object.to_str().unwrap(),
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
    let asset = CapturedObject::read(&object).unwrap();
    assert!(!asset.surface().normals().is_empty());
    assert_eq!(
        TruthSet::open(&labels, TruthLayout::Synth)
            .unwrap()
            .names()
            .len(),
        12
    );
    let mut names: Vec<String> = fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    let expected = [
        "albedo.png",
        "confidence.png",
        "contact.png",
        "highlight.png",
        "light.json",
        "light.txt",
        "mask.png",
        "normal.png",
        "object.relit",
        "shading.png",
        "shadow.png",
        "turn.json",
    ];
    assert_eq!(names, expected);
    let path = |name: &str| out.join(name).to_str().unwrap().to_owned();
    let lit = folder.path().join("lit.png");
    let run = relight(&[
        "render",
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
    other[7] = foreign.to_str().unwrap();
    let run = relight(&other);
    assert_eq!(run.status.code(), Some(1));
    assert!(text(&run.stderr).contains("which is no result of a turn"));
    assert_eq!(fs::read_dir(&foreign).unwrap().count(), 1);
}

#[test]
fn an_even_light_makes_no_labels_but_all_else() {
    let folder = tempfile::tempdir().unwrap();
    let (shard, _) = turn(folder.path(), 24);
    let light = folder.path().join("even.txt");
    let mut even = ShLight::even(Order::TWO, [1.0; 3]);
    even.coefficients_mut()[1] = [0.02; 3];
    even.write(&light).unwrap();
    let (out, labels) = (folder.path().join("solved"), folder.path().join("labels"));
    let run = relight(&[
        "turn",
        shard.to_str().unwrap(),
        "--elevation",
        "20",
        "--light",
        light.to_str().unwrap(),
        "--labels",
        labels.to_str().unwrap(),
        "--no-video",
        "--json",
        "-o",
        out.to_str().unwrap(),
    ]);
    assert_eq!(run.status.code(), Some(3), "{}", text(&run.stderr));
    let said: Vec<serde_json::Value> = text(&run.stdout)
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(
        said[0]["figures"]["conditioning"]["verdict"], "too_even",
        "{said:?}"
    );
    for sentence in ["the environment light is too even", "no labels are written"] {
        let has = |line: &serde_json::Value| {
            let message = line["message"].as_str();
            line["event"] == "warning" && message.is_some_and(|said| said.starts_with(sentence))
        };
        assert_eq!(said.iter().filter(|line| has(line)).count(), 1, "{said:?}");
    }
    assert!(out.join("normal.png").is_file());
    assert!(!labels.exists());
}

#[test]
fn places_that_cannot_be_written_are_told_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    fs::create_dir(folder.path().join("thesis")).unwrap();
    fs::write(folder.path().join("thesis/thesis.tex"), "").unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    // The shard is not there: were it read first, this would be what is told.
    let (shard, out) = (path("missing.tar"), path("solved"));
    for (option, place, says) in [
        ("--labels", "thesis", "thesis.tex, which is no result"),
        ("--labels", "file/labels", "cannot be the folder"),
        (
            "--labels",
            "solved/labels",
            "neither in that of the results",
        ),
        ("--labels", ".", "neither in that of the results"),
        ("--asset", "nowhere/a.relit", "cannot be written"),
        ("--asset", "file/a.relit", "cannot be written"),
        ("--asset", "solved/a.relit", "is called object.relit"),
    ] {
        let run = relight(&[
            "turn",
            &shard,
            "--no-video",
            option,
            &path(place),
            "-o",
            &out,
        ]);
        assert_eq!(run.status.code(), Some(1), "{option} {place}");
        let said = text(&run.stderr);
        assert!(said.contains(says), "{option} {place}: {said}");
    }
    let run = Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(["turn", &shard, "-o", &out])
        .env("PATH", "")
        .output()
        .unwrap();
    let said = text(&run.stderr);
    assert!(said.contains("needs the program ffmpeg"), "{said}");
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
    let (shard, truth_folder) = turn(folder.path(), 24);
    let mut bytes = fs::read(&shard).unwrap();
    let png = bytes.windows(4).position(|four| four == b"IDAT").unwrap();
    bytes[png + 20..png + 60].fill(0);
    fs::write(&shard, &bytes).unwrap();
    let out = folder.path().join("solved");
    let normals = truth_folder.join("normal.png");
    let run = relight(&[
        "turn",
        shard.to_str().unwrap(),
        "--normals",
        normals.to_str().unwrap(),
        "--elevation",
        "20",
        "--no-video",
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
fn wrong_usage_and_several_turns_are_refused() {
    let run = relight(&["turn", "a.tar", "--elevation", "95", "-o", "out"]);
    assert_eq!(run.status.code(), Some(2));
    assert!(text(&run.stderr).contains("0 to 89 degrees"));
    let run = relight(&["turn", "a.tar", "--rim", "100,200", "-o", "out"]);
    assert_eq!(run.status.code(), Some(2));
    // The names of before are still taken: it is the shard that is missing.
    for [direction, material] in [["--direction", "--material"], ["--sense", "--body"]] {
        let options = [direction, "clockwise", material, "metal", "--no-video"];
        let run = relight(&[&["turn", "missing.tar", "-o", "missing"], &options[..]].concat());
        assert_eq!(run.status.code(), Some(1), "{}", text(&run.stderr));
        assert!(
            text(&run.stderr).contains("missing.tar"),
            "{}",
            text(&run.stderr)
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let photo = folder.path().join("photo.jpg");
    fs::write(&photo, [0xff; 2000]).unwrap();
    let run = relight(&["turn", photo.to_str().unwrap(), "-o", "missing"]);
    assert_eq!(run.status.code(), Some(1));
    assert!(
        text(&run.stderr).contains("it is a picture"),
        "{}",
        text(&run.stderr)
    );
    let (shard, _) = turn(folder.path(), 12);
    fs::copy(&shard, folder.path().join("again.tar")).unwrap();
    fs::remove_file(folder.path().join("dataset.json")).unwrap();
    let error = read_curves(folder.path(), TableRotation::default(), &|_, _| {}).unwrap_err();
    assert!(
        matches!(error, TurnError::ManyTurns { found: 2, .. }),
        "{error}"
    );
}

fn untrained() -> Result<Weights, NetError> {
    Ok(Weights::initial(&decomposer(), 1))
}

#[test]
fn initial_normals_are_read_from_a_folder_of_maps() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("normal.png");
    let sphere = Normals::sphere(16);
    sphere
        .write_png(&path, relight_core::image::Depth::Sixteen)
        .unwrap();
    let source = NormalsSource::of(folder.path());
    assert_eq!(source, NormalsSource::Map(path));
    let mask = Planes::filled(sphere.extent(), [1.0]);
    let read = prior_normals(&source, untrained, NormalsFrame::YUp, &[], &mask).unwrap();
    assert_eq!(read.extent(), sphere.extent());
    let net = NormalsSource::of(Path::new("net.onnx"));
    assert_eq!(net, NormalsSource::Onnx("net.onnx".into()));
    let missing = NormalsSource::of(Path::new("missing.safetensors"));
    assert!(prior_normals(&missing, untrained, NormalsFrame::YUp, &[], &mask).is_err());
}
