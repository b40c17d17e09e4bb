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

/// What `--print-settings` says on standard output and standard error of a settings file with this text.
fn printed(verb: &str, settings: &str) -> (String, String) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("settings.toml");
    fs::write(&file, settings).unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_relight"))
        .args(["train", verb, "--print-settings", "--settings"])
        .arg(&file)
        .output()
        .unwrap();
    let told = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{told}");
    (String::from_utf8(output.stdout).unwrap(), told)
}

#[test]
fn old_keys_are_read_with_a_warning_and_printed_as_the_new_ones() {
    let old = "[run]\nrate = 0.25\nwarm_up = 7\n[data]\nwindow = 99\n[loss]\nanchor = 0.5\n";
    let new = "[run]\nlearning_rate = 0.25\nwarmup_steps = 7\n[data]\nshuffle_buffer = 99\n[loss]\nsupervised = 0.5\n";
    let (settings, told) = printed("joint", old);
    assert_eq!((settings, String::new()), printed("joint", new));
    for (old, new) in [
        ("rate", "learning_rate"),
        ("warm_up", "warmup_steps"),
        ("window", "shuffle_buffer"),
        ("anchor", "supervised"),
    ] {
        let line = format!("`{old}` is now `{new}`: this file is read, rename it before 0.4");
        assert!(told.contains(&line), "{told}");
    }
}
