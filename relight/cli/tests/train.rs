//! `relight train` as a user runs it.
#![cfg(feature = "train")]
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by a panic"
)]

use std::fs;
use std::process::Command;

#[test]
fn the_settings_that_are_printed_are_the_defaults_and_can_be_read_again() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("settings.toml");
    for verb in [
        "decompose",
        "spec",
        "normal",
        "light",
        "joint",
        "specular",
        "turn",
    ] {
        let print = |more: &[&str]| {
            let output = Command::new(env!("CARGO_BIN_EXE_relight"))
                .args(["train", verb, "--print-settings"])
                .args(more)
                .output()
                .unwrap();
            let errors = String::from_utf8_lossy(&output.stderr);
            assert!(output.status.success(), "{verb}: {errors}");
            String::from_utf8(output.stdout).unwrap()
        };
        let defaults = print(&[]);
        assert!(defaults.contains("[run]\nseed = 1\n"), "{defaults}");
        fs::write(&file, &defaults).unwrap();
        assert_eq!(print(&["--settings", file.to_str().unwrap()]), defaults);
    }
}
