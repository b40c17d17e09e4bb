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

/// Where a packet's data stand in a file.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    pub(crate) at: usize,
    pub(crate) size: usize,
}

/// The packets of a file's first stream, as `ffprobe` finds them.
pub(crate) fn packets(folder: &Path, name: &str) -> Vec<Place> {
    let output = Command::new("ffprobe")
        .args([
            "-v",
            "error",
            "-show_entries",
            "packet=pos,size",
            "-of",
            "csv=p=0",
            name,
        ])
        .current_dir(folder)
        .output()
        .expect("ffprobe comes with the ffmpeg program: run `make setup`");
    let text = String::from_utf8(output.stdout).unwrap();
    let number = |field: Option<&str>| field.unwrap().parse().unwrap();
    text.lines()
        .map(|line| {
            let mut fields = line.split(',');
            Place {
                size: number(fields.next()),
                at: number(fields.next()),
            }
        })
        .collect()
}
