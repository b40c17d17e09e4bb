//! The protocols, on small sets of which the outcome is known.

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
use relight_core::image::{Depth, Extent, Linear, Planes, Rgb, Srgb};
use relight_core::light::NormalsFrame;
use relight_core::light::{Direction, Normals, Rotation, ShLight};
use relight_core::metrics::MetricError;
use relight_core::reader::{TruthLayout, TruthSet};
use relight_core::render::{DiffuseForm, DiffuseLayer, Gloss, Layers, SpecularForm, Surface};
use relight_eval::{
    EvalError, IntrinsicInput, MaskRule, Predictions, RelightMethod, RelightingRecipe,
    RelightingSet, ScoreLine, ScoreTable, evaluate_highlights, evaluate_intrinsic, evaluate_light,
    evaluate_normals, evaluate_relighting, make_relighting,
};
use relight_photo::decompose::Decomposer;
use relight_photo::nets::Weights;
use relight_synth::{Folders, Library, SynthError};
use relit_data::causes::with_causes;
use relit_test_support::is_named;

const SIDE: usize = 44;
const EXTENT: Extent = Extent::new(SIDE, SIDE);

fn sphere() -> Normals {
    Normals::sphere(SIDE)
}

fn mask() -> Planes<3> {
    let normals = sphere();
    let [x, y, z] = normals.planes().planes();
    let covered = |at: usize| f32::from(u8::from(x[at] != 0.0 || y[at] != 0.0 || z[at] != 0.0));
    Planes::from_fn(EXTENT, |x, y| [covered(y * SIDE + x); 3])
}

fn light() -> ShLight {
    let mut light = ShLight::even(relight_core::light::Order::TWO, [0.15; 3]);
    light.coefficients_mut()[2] = [0.1, 0.12, 0.08];
    light.coefficients_mut()[3] = [0.08; 3];
    light
}

fn albedo() -> Planes<3> {
    Planes::from_fn(EXTENT, |x, _| {
        if x / 6 % 2 == 0 {
            [0.8, 0.3, 0.2]
        } else {
            [0.2, 0.4, 0.6]
        }
    })
}

fn times(a: &Planes<3>, b: &Planes<3>) -> Planes<3> {
    let mut product = a.clone();
    for (a, b) in product.planes_mut().into_iter().zip(b.planes()) {
        a.iter_mut().zip(b).for_each(|(a, b)| *a *= b);
    }
    product
}

/// Writes a set in the layout of MIT Intrinsic Images with the objects `cup` and `pear`.
fn write_set(root: &Path) {
    let shading = DiffuseLayer::new(&light(), DiffuseForm::Irradiance).shading(&sphere());
    let shading = shading.planes().clone().map(|value| value * 0.8);
    for name in ["cup", "pear"] {
        let folder = root.join(name);
        fs::create_dir_all(&folder).unwrap();
        let write = |file: &str, planes: &Planes<3>| {
            let path = folder.join(file);
            write_png(&path, &times(planes, &mask()), Depth::Sixteen).unwrap();
        };
        let diffuse = times(&albedo(), &shading);
        let spot = Planes::from_fn(EXTENT, |x, y| {
            [if (18..24).contains(&x) && (10..16).contains(&y) {
                0.2
            } else {
                0.0
            }; 3]
        });
        let mut original = diffuse.clone();
        for (sum, spot) in original.planes_mut().into_iter().zip(spot.planes()) {
            sum.iter_mut()
                .zip(spot)
                .for_each(|(sum, spot)| *sum += spot);
        }
        write("mask.png", &Planes::filled(EXTENT, [1.0; 3]));
        write("original.png", &original);
        write("diffuse.png", &diffuse);
        write("specular.png", &spot);
        write("reflectance.png", &albedo());
        write("shading.png", &shading);
        let normals = folder.join("normal.png");
        sphere().write_png(&normals, Depth::Sixteen).unwrap();
    }
}

fn set(root: &Path) -> TruthSet {
    TruthSet::open(root, TruthLayout::Mit).unwrap()
}

fn predictions(root: &Path) -> Predictions {
    Predictions::new(root.to_owned(), NormalsFrame::YUp)
}

fn value(line: &ScoreLine, name: &str) -> f64 {
    let found = line.measures.iter().find(|one| one.name == name);
    found
        .unwrap_or_else(|| panic!("{name} is not in {line:?}"))
        .value
}

/// The lines of a method.
fn lines_of<'a>(table: &'a ScoreTable, method: &str) -> Vec<&'a ScoreLine> {
    let lines = table.lines.iter();
    lines.filter(|line| line.method == method).collect()
}

fn intrinsic(root: &Path, found: &[Predictions]) -> Result<ScoreTable, EvalError> {
    let input = IntrinsicInput::Diffuse;
    evaluate_intrinsic(&set(root), "both", input, found, &|_| {})
}

fn said(result: Result<ScoreTable, EvalError>) -> String {
    with_causes(&result.unwrap_err())
}

#[test]
fn a_prediction_that_is_the_truth_up_to_scale_has_no_error() {
    let dir = tempfile::tempdir().unwrap();
    let (truth, found) = (dir.path().join("truth"), dir.path().join("net"));
    write_set(&truth);
    let shading = DiffuseLayer::new(&light(), DiffuseForm::Irradiance).shading(&sphere());
    for name in ["cup", "pear"] {
        fs::create_dir_all(found.join(name)).unwrap();
        let half = albedo().map(|value| value * 0.5);
        write_exr(&found.join(name).join("albedo.exr"), &half).unwrap();
        write_exr(&found.join(name).join("shading.exr"), shading.planes()).unwrap();
    }
    let table = intrinsic(&truth, &[predictions(&found)]).unwrap();
    let lines = lines_of(&table, "net");
    let parts: Vec<&str> = lines.iter().map(|line| line.part.as_str()).collect();
    assert_eq!(
        parts,
        ["albedo", "shading", "mean", "albedo", "shading", "mean"]
    );
    for line in lines {
        assert_eq!(line.images, 2);
        assert!(
            value(line, "SMSE") < 1e-8 && value(line, "LMSE") < 1e-7,
            "{line:?}"
        );
    }
    let images = table.images.iter().filter(|one| one.method == "net");
    let images: Vec<&str> = images.map(|one| one.image.as_str()).collect();
    assert_eq!(images, ["cup", "pear"]);
}

#[test]
fn the_mean_is_that_of_albedo_and_shading_and_each_line_says_how_it_was_measured() {
    let dir = tempfile::tempdir().unwrap();
    write_set(dir.path());
    let table = intrinsic(dir.path(), &[]).unwrap();
    assert_eq!(table.lines.len(), 5 * 6);
    for three in table.lines.chunks(3) {
        for name in ["SMSE", "LMSE"] {
            let [albedo, shading, mean] = [0, 1, 2].map(|at| value(&three[at], name));
            assert!((f64::midpoint(albedo, shading) - mean).abs() < 1e-12);
        }
        let terms = &three[0];
        assert_eq!(
            (terms.mask, terms.images, terms.split.as_str()),
            (MaskRule::Object, 2, "both")
        );
        assert!(!terms.colour.is_empty() && !terms.scale.is_empty());
    }
}

#[test]
fn the_oracle_s_normals_and_light_explain_a_shading_of_order_two() {
    let dir = tempfile::tempdir().unwrap();
    write_set(dir.path());
    let table = intrinsic(dir.path(), &[]).unwrap();
    let oracle = lines_of(&table, "oracle: true normals, fitted light");
    assert!(value(oracle[1], "SMSE") < 1e-4, "{:?}", oracle[1]);
    let (set, form) = (set(dir.path()), DiffuseForm::Irradiance);
    let table = evaluate_light(&set, "both", form, &[], &|_| {}).unwrap();
    let oracle = lines_of(&table, "oracle: fitted to the ground truth")[0];
    assert!(value(oracle, "MSE") < 1e-6 && value(oracle, "SSIM") > 0.999);
}

#[test]
fn predicted_light_is_judged_by_the_shading_that_it_makes() {
    let dir = tempfile::tempdir().unwrap();
    let (truth, found) = (dir.path().join("truth"), dir.path().join("net"));
    write_set(&truth);
    for name in ["cup", "pear"] {
        fs::create_dir_all(found.join(name)).unwrap();
        let text = light().tinted([3.0; 3]).to_string();
        fs::write(found.join(name).join("light.txt"), text).unwrap();
    }
    let run = || {
        let (found, form) = ([predictions(&found)], DiffuseForm::Irradiance);
        evaluate_light(&set(&truth), "both", form, &found, &|_| {})
    };
    let table = run().unwrap();
    let line = lines_of(&table, "net")[0];
    assert!(value(line, "MSE") < 1e-8, "{line:?}");
    fs::write(found.join("cup/light.txt"), "1 2\n").unwrap();
    let text = said(run());
    assert!(text.contains("light.txt"), "{text}");
}

#[test]
fn predicted_light_is_judged_by_where_it_comes_from() {
    let dir = tempfile::tempdir().unwrap();
    let (truth, found) = (dir.path().join("truth"), dir.path().join("net"));
    write_set(&truth);
    let turned = Rotation::about(Direction::UP, 0.3);
    for name in ["cup", "pear"] {
        fs::create_dir_all(found.join(name)).unwrap();
        let text = light().rotated(&turned).to_string();
        fs::write(found.join(name).join("light.txt"), text).unwrap();
    }
    let (found, form) = ([predictions(&found)], DiffuseForm::Irradiance);
    let table = evaluate_light(&set(&truth), "both", form, &found, &|_| {}).unwrap();
    let directions = table.lines.iter().filter(|line| line.part == "direction");
    let degrees: Vec<f64> = directions.map(|line| value(line, "degrees")).collect();
    // Band 1 has no vertical part, so that it turns by the whole angle.
    for (found, expected) in degrees.iter().zip([90.0, 0.0, 0.3_f64.to_degrees()]) {
        assert!((found - expected).abs() < 0.1, "{degrees:?}");
    }
    assert_eq!(degrees.len(), 3);
}

#[test]
fn predicted_normals_are_read_in_the_axes_that_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let (truth, found) = (dir.path().join("truth"), dir.path().join("net"));
    write_set(&truth);
    for name in ["cup", "pear"] {
        fs::create_dir_all(found.join(name)).unwrap();
        let down: Normals = sphere().flipped();
        let path = found.join(name).join("normal.png");
        down.write_png(&path, Depth::Sixteen).unwrap();
    }
    let mean_angle = |frame| {
        let found = [Predictions::new(found.clone(), frame)];
        let table = evaluate_normals(&set(&truth), "both", &found, &|_| {}).unwrap();
        let line = lines_of(&table, "net")[0];
        assert_eq!(line.mask, MaskRule::Known);
        value(line, "mean angle")
    };
    assert!(mean_angle(NormalsFrame::YDown) < 0.01);
    assert!(mean_angle(NormalsFrame::YUp) > 20.0);
}

#[test]
fn a_highlight_that_is_right_leaves_the_image_without_it() {
    let dir = tempfile::tempdir().unwrap();
    let (truth, found) = (dir.path().join("truth"), dir.path().join("net"));
    write_set(&truth);
    // Under either name: that of the protocol, and that of `relight decompose`.
    for (name, file) in [("cup", "highlight.png"), ("pear", "specular.png")] {
        fs::create_dir_all(found.join(name)).unwrap();
        let from = truth.join(name).join("specular.png");
        fs::copy(from, found.join(name).join(file)).unwrap();
    }
    let found = [predictions(&found)];
    let table = evaluate_highlights(&set(&truth), "both", &found, &|_| {}).unwrap();
    let (nothing, right) = table.lines.split_at(4);
    for (nothing, right) in nothing.iter().zip(right) {
        assert_eq!(nothing.part, right.part);
        assert!(value(nothing, "MSE") > 1e-4 && value(nothing, "DSSIM") > 1e-4);
        assert!(value(right, "MSE") < 1e-12 && value(right, "DSSIM") < 1e-9);
    }
}

#[test]
fn what_cannot_be_compared_is_an_error_that_names_it() {
    let dir = tempfile::tempdir().unwrap();
    let (truth, found) = (dir.path().join("truth"), dir.path().join("net"));
    write_set(&truth);
    let run = || intrinsic(&truth, &[predictions(&found)]);
    let text = said(run());
    assert!(is_named(&text, &["albedo.exr", "albedo.png"]), "{text}");

    for name in ["cup", "pear"] {
        fs::create_dir_all(found.join(name)).unwrap();
        for part in ["albedo.exr", "shading.exr"] {
            write_exr(&found.join(name).join(part), &albedo()).unwrap();
        }
    }
    assert!(run().is_ok());
    let spoiled = Planes::filled(EXTENT, [f32::NAN; 3]);
    write_exr(&found.join("pear/shading.exr"), &spoiled).unwrap();
    let text = said(run());
    assert!(is_named(&text, &["pear", "NaN"]), "{text}");

    let small = Planes::filled(Extent::new(9, 7), [0.5; 3]);
    write_exr(&found.join("pear/shading.exr"), &small).unwrap();
    let text = said(run());
    assert!(is_named(&text, &["shading.exr", "9x7", "44x44"]), "{text}");

    write_png(
        &truth.join("cup/mask.png"),
        &Planes::zeros(EXTENT),
        Depth::Eight,
    )
    .unwrap();
    write_exr(&found.join("pear/shading.exr"), &albedo()).unwrap();
    let text = said(run());
    let empty = MetricError::EmptyMask.to_string();
    assert!(is_named(&text, &["cup", &empty]), "{text}");

    fs::remove_file(truth.join("cup/normal.png")).unwrap();
    let text = said(evaluate_normals(&set(&truth), "both", &[], &|_| {}));
    assert!(is_named(&text, &["normals", "cup"]), "{text}");
}

/// Writes a set of one object under three lights of different colours, rendered by the layers themselves.
fn write_relighting(root: &Path) {
    let colours = [[1.0, 1.0, 1.0], [0.3, 0.5, 0.9], [1.1, 0.4, 0.3]];
    write_relighting_under(&colours.map(|colour| light().tinted(colour)), root);
}

/// The same under three lights; the image under the second is relit.
fn write_relighting_under(lights: &[ShLight; 3], root: &Path) {
    fs::create_dir_all(root.join("lights")).unwrap();
    fs::create_dir_all(root.join("000")).unwrap();
    for (number, light) in lights.iter().enumerate() {
        fs::write(
            root.join(format!("lights/{number:02}.txt")),
            light.to_string(),
        )
        .unwrap();
        for (part, surface) in [
            ("diffuse", surface().with_gloss(None).unwrap()),
            ("full", surface()),
        ] {
            let path = root.join(format!("000/{number:02}-{part}.png"));
            write_png(&path, &rendered(&surface, light), Depth::Sixteen).unwrap();
        }
    }
    write_png(&root.join("000/mask.png"), &mask(), Depth::Eight).unwrap();
    write_png(&root.join("000/albedo.png"), &albedo(), Depth::Sixteen).unwrap();
    sphere()
        .write_png(&root.join("000/normal.png"), Depth::Sixteen)
        .unwrap();
    let index = r#"{"schema": "relight.relighting/2", "about": "by hand", "lights": ["a", "b", "c"],
        "objects": [{"name": "ball", "input": 1, "reflectance": [0.2, 0.2, 0.2], "smoothness": 20}]}"#;
    fs::write(root.join("relighting.json"), index).unwrap();
}

fn surface() -> Surface {
    let gloss = Gloss::even(EXTENT, [0.2; 3], 20.0);
    Surface::new(sphere(), Rgb::new(albedo()), Some(gloss)).unwrap()
}

fn rendered(surface: &Surface, light: &ShLight) -> Planes<3> {
    let layers = Layers::new(light, DiffuseForm::Irradiance, SpecularForm::Lobe);
    let image = layers.render(surface).image(surface.albedo()).unwrap();
    let clipped = image.into_planes().map(|value| value.clamp(0.0, 1.0));
    times(
        Rgb::<Linear>::new(clipped).encode::<Srgb>().planes(),
        &mask(),
    )
}

#[test]
fn relighting_compares_with_all_lights_but_the_input_s() {
    let dir = tempfile::tempdir().unwrap();
    write_relighting(dir.path());
    let set = RelightingSet::open(dir.path()).unwrap();
    let methods = [
        RelightMethod::Naive,
        RelightMethod::Oracle(SpecularForm::Lobe),
    ];
    let table = evaluate_relighting(&set, "one", &methods, &|_| {}).unwrap();
    let (naive, oracle) = table.lines.split_at(4);
    for (naive, oracle) in naive.iter().zip(oracle) {
        assert_eq!((naive.images, oracle.images), (2, 2));
        assert!(value(naive, "MSE") > 1e-3, "{naive:?}");
        assert!(
            value(oracle, "MSE") < 1e-7 && value(oracle, "DSSIM") < 1e-4,
            "{oracle:?}"
        );
    }
    let whole = naive.iter().find(|line| line.mask == MaskRule::WholeImage);
    assert!(value(whole.unwrap(), "MSE") < value(&naive[0], "MSE"));
}

#[test]
fn what_the_network_makes_of_the_image_is_nearer_than_the_image() {
    let dir = tempfile::tempdir().unwrap();
    let turned =
        |degrees: f64| light().rotated(&Rotation::about(Direction::UP, degrees.to_radians()));
    write_relighting_under(&[0.0, 120.0, 240.0].map(turned), dir.path());
    let set = RelightingSet::open(dir.path()).unwrap();
    let weights = Path::new(env!("CARGO_MANIFEST_DIR")).join("weights/decompose.safetensors");
    let decomposer = Decomposer::new(&Weights::read(&weights).unwrap()).unwrap();
    let methods = [
        RelightMethod::Naive,
        RelightMethod::Photograph(&decomposer),
        RelightMethod::Maps(&decomposer),
    ];
    let table = evaluate_relighting(&set, "one", &methods, &|_| {}).unwrap();
    let (naive, found) = table.lines.split_at(4);
    for (at, line) in found.iter().enumerate() {
        let (found, naive) = (value(line, "MSE"), value(&naive[at % 4], "MSE"));
        assert!(found < 0.5 * naive, "{found} {naive}: {line:?}");
    }
}

#[test]
fn predicted_images_are_taken() {
    let dir = tempfile::tempdir().unwrap();
    let (truth, images) = (dir.path().join("t"), dir.path().join("i"));
    fs::create_dir_all(&truth).unwrap();
    write_relighting(&truth);
    fs::create_dir_all(images.join("000")).unwrap();
    for light in ["00", "02"] {
        for part in ["diffuse", "full"] {
            let file = format!("000/{light}-{part}.png");
            fs::copy(truth.join(&file), images.join(&file)).unwrap();
        }
    }
    let set = RelightingSet::open(&truth).unwrap();
    let methods = [RelightMethod::Predictions(predictions(&images))];
    let table = evaluate_relighting(&set, "one", &methods, &|_| {}).unwrap();
    for line in &table.lines {
        assert!(value(line, "MSE") < 1e-7, "{line:?}");
    }
    fs::remove_file(images.join("000/02-full.png")).unwrap();
    let text = said(evaluate_relighting(&set, "one", &methods, &|_| {}));
    assert!(text.contains("02-full.png"), "{text}");
}

#[test]
fn a_set_of_another_version_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    write_relighting(dir.path());
    let path = dir.path().join("relighting.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("relighting/2", "relighting/9")).unwrap();
    let text = with_causes(&RelightingSet::open(dir.path()).unwrap_err());
    assert!(text.contains("relight.relighting/9"), "{text}");
}

#[test]
fn a_made_set_goes_on_with_more_objects_but_not_with_other_settings() {
    let dir = tempfile::tempdir().unwrap();
    let library = Library::read(&Folders::default()).unwrap();
    let recipe = RelightingRecipe {
        objects: 1,
        lights: 2,
        size: 16,
        ..RelightingRecipe::default()
    };
    let make = |recipe: &RelightingRecipe| make_relighting(recipe, &library, dir.path(), &|_| {});
    make(&recipe).unwrap();
    let more = RelightingRecipe {
        objects: 2,
        ..recipe.clone()
    };
    make(&more).unwrap();
    assert_eq!(RelightingSet::open(dir.path()).unwrap().objects(), 2);
    let larger = RelightingRecipe { size: 24, ..recipe };
    let error = make(&larger).unwrap_err();
    let is_refused = matches!(error, EvalError::Synth(SynthError::Unusable { .. }));
    assert!(is_refused, "{error}");
    assert_eq!(RelightingSet::open(dir.path()).unwrap().objects(), 2);
}

fn relight(arguments: &[&str]) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .arg("eval")
        .args(arguments)
        .output()
        .unwrap()
}

#[test]
fn a_table_that_does_not_fit_onto_the_disk_is_told() {
    let dir = tempfile::tempdir().unwrap();
    write_set(&dir.path().join("truth"));
    let full = fs::File::create("/dev/full").unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(["eval", "mit", "--count", "1", "--data"])
        .arg(dir.path().join("truth"))
        .stdout(full)
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3), "{output:?}");
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(told.contains("(os error 28)"), "{told}");
}

#[test]
fn the_program_prints_a_table_and_writes_it_as_json() {
    let dir = tempfile::tempdir().unwrap();
    write_set(&dir.path().join("truth"));
    let (data, out) = (dir.path().join("truth"), dir.path().join("table.json"));
    let (data, out) = (data.to_str().unwrap(), out.to_str().unwrap());
    let output = relight(&["mit", "--data", data, "--count", "1", "-o", out]);
    assert_eq!(output.status.code(), Some(0), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("truth") && text.contains("SMSE"), "{text}");
    let json: serde_json::Value = serde_json::from_slice(&fs::read(out).unwrap()).unwrap();
    assert_eq!(json["protocol"], "intrinsic images");
    assert_eq!(json["lines"][0]["images"], 1);

    let output = relight(&["highlight", "--json", "--data", data]);
    let event: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(event["table"]["protocol"], "highlights");
}

#[test]
fn the_program_says_what_is_wrong() {
    let dir = tempfile::tempdir().unwrap();
    let empty = dir.path().to_str().unwrap();
    let output = relight(&["mit", "--data", empty]);
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stderr).unwrap();
    assert!(text.contains(empty), "{text}");
    let output = relight(&["normals", "--data", empty, "--layout", "nyu"]);
    assert_eq!(output.status.code(), Some(2));
    let output = relight(&["normals", "--data", empty, "--count", "0"]);
    assert_eq!(output.status.code(), Some(2));
}
