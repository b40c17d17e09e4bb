//! ONNX Runtime beside tract. Where the library is not installed (`ORT_DYLIB_PATH`, or as the system knows it), these
//! tests say so and look at nothing.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use image::{Rgba, RgbaImage};
use relight_core::image::{Extent, Planes, Rgb};
use relight_photo::decompose::{DecomposeOptions, Decomposer, SpecularGate};
use relight_photo::nets::paper::{Head, light_net, normal_net, spec_net};
use relight_photo::nets::{
    Inference, InferenceEngine, NetError, OnnxRuntime, Weights, decomposer_with_heads, to_onnx,
};

const SIDE: usize = 64;

fn onnx_runtime() -> Option<InferenceEngine> {
    let named = env::var_os("ORT_DYLIB_PATH").filter(|path| !path.is_empty());
    let path = PathBuf::from(named.unwrap_or_else(|| OnnxRuntime::library().into()));
    match OnnxRuntime::load(&path) {
        Ok(library) => Some(InferenceEngine::OnnxRuntime(library)),
        Err(fault) => {
            relit_test_support::say_skipped(&fault.to_string());
            None
        }
    }
}

/// The largest difference.
fn difference(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    let pairs = a.iter().zip(b);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// The weights that the program comes with.
fn shipped() -> Weights {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("weights/decompose.safetensors");
    Weights::read(&path).unwrap()
}

#[test]
fn every_network_answers_the_same_by_both_engines() {
    let Some(other) = onnx_runtime() else { return };
    for graph in [
        decomposer_with_heads(),
        spec_net(),
        normal_net(),
        light_net(Head::Pooled),
    ] {
        let weights = Weights::initial(&graph, 3);
        let values = (0..graph.input_channels() * SIDE * SIDE).map(|at| (at % 97) as f32 / 97.0);
        let input: Vec<f32> = values.collect();
        let answer = |engine: &InferenceEngine| {
            let net = Inference::with_engine(&graph, &weights, (SIDE, SIDE), engine).unwrap();
            net.run(&input).unwrap()
        };
        let (one, two) = (answer(&InferenceEngine::Tract), answer(&other));
        assert_eq!(one.len(), two.len());
        for (one, two) in one.iter().zip(&two) {
            assert_eq!(one.shape(), two.shape());
            let largest = one
                .values()
                .iter()
                .fold(1.0_f32, |most, v| most.max(v.abs()));
            let off = difference(one.values(), two.values()) / largest;
            assert!(off < 1e-4, "{}: {off}", graph.name());
        }
    }
}

#[test]
fn a_photograph_has_the_same_layers_by_both_engines() {
    let Some(other) = onnx_runtime() else { return };
    let extent = Extent::new(150, 110);
    let picture = Planes::from_fn(extent, |x, y| {
        [x, y, x + y].map(|v| 0.1 + 0.8 * (v as f32 / 40.0).sin().abs())
    });
    let picture = Rgb::new(picture);
    let mask = Planes::from_fn(extent, |x, y| {
        let distance = (x as f32 - 75.0).hypot(y as f32 - 55.0);
        [f32::from(u8::from(distance < 50.0))]
    });
    let weights = shipped();
    let options = DecomposeOptions {
        specular: SpecularGate::On,
        ..DecomposeOptions::default()
    };
    let layers = |engine: InferenceEngine| {
        let decomposer = Decomposer::with_engine(&weights, 128, engine).unwrap();
        decomposer.decompose(&picture, &mask, &options).unwrap()
    };
    let (one, two) = (layers(InferenceEngine::Tract), layers(other));
    for (name, one, two) in [
        (
            "normals",
            one.normals.planes().planes().concat(),
            two.normals.planes().planes().concat(),
        ),
        (
            "albedo",
            one.albedo.planes().planes().concat(),
            two.albedo.planes().planes().concat(),
        ),
        (
            "shading",
            one.shading.planes().concat(),
            two.shading.planes().concat(),
        ),
        (
            "highlight",
            one.highlight.planes().concat(),
            two.highlight.planes().concat(),
        ),
    ] {
        let off = difference(&one, &two);
        assert!(off < 1e-3, "{name}: {off}");
    }
}

#[test]
fn what_is_no_network_is_told_by_the_library_too() {
    let Some(engine) = onnx_runtime() else { return };
    let path = Path::new("net.onnx");
    let read = |bytes: &[u8]| Inference::from_onnx(path, bytes, 3, (SIDE, SIDE), &[], &engine);
    let fault = read(b"not a network").unwrap_err();
    assert!(matches!(fault, NetError::File { .. }), "{fault}");
    // A network that takes another number of channels.
    let graph = decomposer_with_heads();
    let bytes = to_onnx(&graph, &Weights::initial(&graph, 1), 1, (SIDE, SIDE)).unwrap();
    let answered = read(&bytes).and_then(|net| net.run(&vec![0.0; 3 * SIDE * SIDE]));
    assert!(answered.is_err());
}

#[test]
fn a_library_that_is_not_there_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let missing = OnnxRuntime::load(&folder.path().join("libonnxruntime.so")).unwrap_err();
    assert!(matches!(missing, NetError::NoLibrary { .. }), "{missing}");
}

fn decompose(folder: &Path, engine: &str, library: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .args([
            "decompose",
            "cup.png",
            "--no-mirror",
            "--engine",
            engine,
            "-o",
            engine,
        ])
        .env("ORT_DYLIB_PATH", library)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn a_library_that_cannot_be_used_is_an_error_or_with_auto_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let cup = RgbaImage::from_fn(40, 40, |x, y| {
        let alpha = if x < 4 { 0 } else { 255 };
        Rgba([120, 80 + x as u8, 90 + y as u8, alpha])
    });
    cup.save(folder.path().join("cup.png")).unwrap();
    fs::write(folder.path().join("broken.so"), b"no library").unwrap();
    let text = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();

    let asked = decompose(folder.path(), "onnxruntime", "broken.so");
    assert_eq!(asked.status.code(), Some(1), "{}", text(&asked));
    assert!(
        text(&asked).contains("broken.so cannot be used: "),
        "{}",
        text(&asked)
    );
    assert!(!folder.path().join("onnxruntime").exists());

    let missing = decompose(folder.path(), "onnxruntime", "missing.so");
    assert!(
        text(&missing).contains("there is no ONNX Runtime at missing.so"),
        "{}",
        text(&missing)
    );

    let auto = decompose(folder.path(), "auto", "broken.so");
    assert_eq!(auto.status.code(), Some(0), "{}", text(&auto));
    assert!(
        text(&auto).contains("warning: tract is used"),
        "{}",
        text(&auto)
    );
    assert!(folder.path().join("auto/normal.png").is_file());
}
