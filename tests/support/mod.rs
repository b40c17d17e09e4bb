//! What the tests share: making videos with the `ffmpeg` program, which `make setup` installs.
#![allow(
    dead_code,
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic
)]

use std::path::Path;
use std::process::Command;

/// Runs `ffmpeg` with these arguments and answers what it wrote to standard output.
pub(crate) fn ffmpeg(folder: &Path, arguments: &[&str]) -> Vec<u8> {
    let output = Command::new("ffmpeg")
        .args(["-nostdin", "-loglevel", "error", "-y"])
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("the tests make their videos with the ffmpeg program: run `make setup`");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "ffmpeg {arguments:?}: {errors}");
    output.stdout
}
