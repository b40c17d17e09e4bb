//! `relight train` of a program that was built without training.
#![cfg(not(feature = "train"))]
#![allow(clippy::unwrap_used, reason = "a test fails by a panic")]

use std::process::Command;

#[test]
fn training_fails_with_the_command_that_adds_it() {
    for arguments in [
        &["train"][..],
        &["train", "decompose", "-o", "run"],
        &["train", "turn", "--settings", "turn.toml"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_relight"))
            .args(arguments)
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        let errors = String::from_utf8(output.stderr).unwrap();
        assert_eq!(errors.lines().count(), 1, "{errors}");
        assert!(errors.contains("--features train"), "{errors}");
    }
}
