//! Files that are no networks, or damaged, and answers that are none: one sentence each, and no mask.

use std::fs;
use std::path::{Path, PathBuf};

use relit_grabcut::{Hints, SegmentSettings};
use relit_mask::{MaskRequest, MaskingError};
use relit_test_support::disc::AROUND;

use super::super::support::{code, relit_mask, said};
use super::files::{Writer, decoder, encoder, u2netp};
use super::folder_with;

/// A network whose first answer is this of what its picture's grey is.
fn answering(operation: &str, further: &[&str], attributes: &[(&str, &[i64])]) -> Vec<u8> {
    let mut writer = Writer::default();
    writer.input("x", &[1, 3, 64, 64]);
    writer.constant("zero", &[], &[0.0]);
    writer.constant("half", &[], &[0.1]);
    writer.bright("x", 1, (0.0, 1.0), "bright");
    let inputs = [&["bright"], further].concat();
    writer.node(operation, &inputs, "y", attributes);
    writer.output("y");
    writer.bytes()
}

/// One whose inputs are others.
fn taking(inputs: &[(&str, &[i64])]) -> Vec<u8> {
    let mut writer = Writer::default();
    for (name, sides) in inputs {
        writer.input(name, sides);
    }
    writer.node("Identity", &[inputs[0].0], "y", &[]);
    writer.output("y");
    writer.bytes()
}

#[test]
fn a_file_that_cannot_be_used_and_an_answer_that_is_none_end_with_one_sentence() {
    let whole = u2netp();
    let pooled: &[(&str, &[i64])] = &[("kernel_shape", &[64, 64])];
    let halved: &[(&str, &[i64])] = &[("kernel_shape", &[1, 2]), ("strides", &[1, 2])];
    let unbound: &[(&str, &[i64])] = &[("axis", &[7])];
    let networks = [
        ("empty", Vec::new()),
        ("text", b"not a network".to_vec()),
        ("cut", whole[..whole.len() / 2].to_vec()),
        ("numbers", answering("Div", &["zero"], &[])),
        ("nothing", answering("Mul", &["zero"], &[])),
        ("everything", answering("Equal", &["bright"], &[])),
        ("other size", answering("AveragePool", &[], pooled)),
        ("other shape", answering("AveragePool", &[], halved)),
        ("unknown", answering("Frobnicate", &[], &[])),
        ("wrong axis", answering("Flatten", &[], unbound)),
        ("not there", answering("Add", &["nowhere"], &[])),
        ("tokens", taking(&[("tokens", &[1, 128])])),
        ("masks", taking(&[("image", &[1, 4, 64, 64])])),
        (
            "two",
            taking(&[("image", &[1, 3, 64, 64]), ("scale", &[1])]),
        ),
        ("encoder", encoder()),
        ("decoder", decoder(&[0.0; 4], &[2.0, 3.0])),
    ];
    let folder = folder_with(&networks);
    let folder = folder.path();
    fs::create_dir(folder.join("folder")).unwrap();
    let names = networks.iter().map(|(name, _)| *name);
    for name in names.chain(["missing", "folder"]) {
        let done = relit_mask(folder, &["disc.png", "--model", name, "-o", "mask.png"]);
        assert_eq!(code(&done), 1, "{name}: {}", said(&done));
        let said = said(&done);
        assert_eq!(said.lines().count(), 1, "{name}: {said}");
        assert!(!folder.join("mask.png").exists(), "{name}");
    }
    let named = |name: &str, things: &[&str]| {
        let done = relit_mask(folder, &["disc.png", "--model", name, "-o", "mask.png"]);
        let said = said(&done);
        assert!(things.iter().all(|thing| said.contains(thing)), "{said}");
    };
    named("tokens", &["tokens", "1 x 128"]);
    named("two", &["image", "1 x 3 x 64 x 64", "scale"]);
    named("other size", &["1 x 1 x 1 x 1"]);
}

#[test]
fn an_encoder_and_a_decoder_that_do_not_belong_together_are_refused() {
    let networks = [
        ("encoder", encoder()),
        ("small", {
            let mut writer = Writer::default();
            writer.input("input_image", &[1, 3, 64, 64]);
            writer.bright("input_image", 1, (0.0, 1.0), "image_embeddings");
            writer.output("image_embeddings");
            writer.bytes()
        }),
        ("decoder", decoder(&[0.0; 4], &[2.0, 3.0])),
        ("net", u2netp()),
    ];
    let folder = folder_with(&networks);
    for (first, second) in [
        ("small", "net"),
        ("decoder", "decoder"),
        ("encoder", "net"),
        ("net", "net"),
    ] {
        let arguments = [
            "disc.png", "--model", first, "--model", second, "--rect", AROUND,
        ];
        let done = relit_mask(folder.path(), &arguments);
        assert_eq!(code(&done), 1, "{first} {second}: {}", said(&done));
        assert_eq!(said(&done).lines().count(), 1, "{}", said(&done));
    }
}

fn opened(path: &Path) -> Result<MaskRequest, MaskingError> {
    let request = MaskRequest::new(0, Hints::default(), SegmentSettings::default());
    request.with_network(&[PathBuf::from(path)])
}

#[test]
fn a_network_that_needs_too_much_memory_is_refused_before_it_is_run() {
    let folder = folder_with(&[("huge", {
        let mut writer = Writer::default();
        writer.input("x", &[1, 3, 4096, 4096]);
        writer.constant("w", &[400, 3, 1, 1], &[0.01; 1200]);
        writer.node("Conv", &["x", "w"], "wide", &[]);
        writer.bright("wide", 1, (0.0, 1.0), "y");
        writer.output("y");
        writer.bytes()
    })]);
    let fault = opened(&folder.path().join("huge"));
    assert!(matches!(fault, Err(MaskingError::Unusable { why, .. }) if why.contains("memory")));
}

#[test]
fn damage_anywhere_ends_nothing() {
    let whole = u2netp();
    let folder = folder_with(&[]);
    let path = folder.path().join("damaged");
    for at in (0..whole.len()).step_by(37) {
        let mut damaged = whole.clone();
        damaged[at] ^= 0x5a;
        fs::write(&path, &damaged).unwrap();
        let _ = opened(&path);
        fs::write(&path, &whole[..at]).unwrap();
        assert!(opened(&path).is_err(), "{at}");
    }
}

#[test]
fn weights_are_read_from_a_file_beside_the_network_and_nowhere_else() {
    let folder = folder_with(&[]);
    let inner = folder.path().join("inner");
    fs::create_dir(&inner).unwrap();
    let values: Vec<u8> = [0.3_f32; 3]
        .iter()
        .flat_map(|value| value.to_le_bytes())
        .collect();
    fs::write(inner.join("net.onnx.data"), &values).unwrap();
    fs::write(folder.path().join("outside.data"), &values).unwrap();
    let network = |location: &str| {
        let mut writer = Writer::default();
        writer.input("x", &[1, 3, 64, 64]);
        writer.weights_in("w", &[1, 3, 1, 1], location);
        writer.node("Conv", &["x", "w"], "y", &[]);
        writer.output("y");
        fs::write(inner.join("net.onnx"), writer.bytes()).unwrap();
        opened(&inner.join("net.onnx"))
    };
    assert!(network("net.onnx.data").is_ok());
    let arguments = ["disc.png", "--model", "inner/net.onnx"];
    let done = relit_mask(folder.path(), &arguments);
    assert_eq!(code(&done), 0, "{}", said(&done));
    let record = super::record(folder.path(), "mask.json");
    let hash = blake3::hash(&values).to_hex().to_string();
    assert_eq!(record["network"]["files"][1]["name"], "net.onnx.data");
    assert_eq!(record["network"]["files"][1]["blake3"], hash);
    for location in ["../outside.data", "missing.data", ""] {
        assert!(network(location).is_err(), "{location}");
    }
}
