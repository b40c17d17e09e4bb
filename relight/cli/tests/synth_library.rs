//! `relight synth library` as a user runs it, and samples drawn from what it packs.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test that cannot go on has failed"
)]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn relight(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(arguments)
        .output()
        .unwrap()
}

const BLOCK: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 1 4 3 2\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 7 8\n";

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn a_library_is_packed_and_samples_are_drawn_from_it() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    let (models, light, library) = (at("models"), at("light"), at("a.relib"));
    fs::create_dir(&models).unwrap();
    fs::write(models.join("block.obj"), BLOCK).unwrap();
    fs::write(models.join("broken.obj"), "v 0 0\n").unwrap();
    fs::write(
        models.join("origin.toml"),
        "author = \"Ann\"\nlicence = \"CC0-1.0\"\nvalidation = false\n",
    )
    .unwrap();
    let made = relight(&["synth", "panoramas", "-o", text(&light)]);
    assert!(made.status.success(), "{made:?}");
    fs::write(
        light.join("origin.toml"),
        "author = \"relight\"\nlicence = \"CC0-1.0\"\n",
    )
    .unwrap();

    let build = |out: &Path| {
        relight(&[
            "synth",
            "library",
            "--meshes",
            text(&models),
            "--panoramas",
            text(&light),
            "-o",
            text(out),
        ])
    };
    let built = build(&library);
    assert_eq!(built.status.code(), Some(3), "{built:?}");
    let warned = String::from_utf8_lossy(&built.stderr);
    assert!(
        warned.contains("broken.obj") && warned.contains("line 1"),
        "{warned}"
    );
    let table = fs::read_to_string(at("a.csv")).unwrap();
    assert!(
        table.contains("object,models/block.obj,block,,Ann,CC0-1.0,models,training,12,"),
        "{table}"
    );
    assert_eq!(build(&at("a.zip")).status.code(), Some(1));

    let out = at("samples");
    let drawn = relight(&[
        "synth",
        "samples",
        "--count",
        "1",
        "--size",
        "32",
        "--meshes",
        text(&library),
        "--panoramas",
        text(&library),
        "-o",
        text(&out),
    ]);
    assert_eq!(drawn.status.code(), Some(0), "{drawn:?}");
    let recipe = fs::read_to_string(out.join("synth.json")).unwrap();
    assert!(recipe.contains("models/block.obj"), "{recipe}");
    assert_eq!(relight(&["synth"]).status.code(), Some(2));
    assert_eq!(
        relight(&["synth", "library", "-o", text(&library)])
            .status
            .code(),
        Some(2)
    );
}
