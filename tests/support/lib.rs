//! What the tests of several crates share: making videos with the `ffmpeg` program, which `make setup`
//! installs.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test fails by a panic, in its helpers too"
)]

use std::path::Path;
use std::process::Command;

/// Runs `ffmpeg` in `folder` with these arguments and returns what it wrote to standard output.
///
/// # Panics
/// If it cannot be run or fails.
pub fn ffmpeg(folder: &Path, arguments: &[&str]) -> Vec<u8> {
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

/// The part of a file that holds a packet's data.
#[derive(Debug, Clone, Copy)]
pub struct PacketExtent {
    /// Offset in the file, bytes.
    pub at: usize,
    /// Length, bytes.
    pub size: usize,
}

/// The packets of the first stream of the file `name` in `folder`, as `ffprobe` finds them.
///
/// # Panics
/// If `ffprobe` cannot be run or prints something else.
#[must_use]
pub fn packets(folder: &Path, name: &str) -> Vec<PacketExtent> {
    let output = Command::new("ffprobe")
        .args(["-v", "error", "-show_entries", "packet=pos,size"])
        .args(["-of", "csv=p=0", name])
        .current_dir(folder)
        .output()
        .expect("ffprobe comes with the ffmpeg program: run `make setup`");
    let text = String::from_utf8(output.stdout).unwrap();
    let number = |field: Option<&str>| field.unwrap().parse().unwrap();
    text.lines()
        .map(|line| {
            let mut fields = line.split(',');
            PacketExtent {
                size: number(fields.next()),
                at: number(fields.next()),
            }
        })
        .collect()
}
