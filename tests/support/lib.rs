//! What the tests of several crates share: making videos with the `ffmpeg` program, which `make setup`
//! installs, a browser, the toolkit's own programs, and tests that say when they did not run.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "a test fails by a panic, in its helpers too"
)]

pub mod chromium;
pub mod disc;
pub mod editor_canvas;
pub mod firmware;
pub mod help;
mod programs;
pub mod trials;
mod turning;

use std::io::Write;
use std::path::Path;
use std::process::Command;

pub use programs::{beside_this_test, program};
pub use turning::turning;

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

/// Whether a line of `text` names all of these things (files, numbers, options). How it says so is free, so that
/// messages can be improved without a change of tests.
pub fn is_named(text: &str, things: &[&str]) -> bool {
    text.lines()
        .any(|line| things.iter().all(|thing| line.contains(thing)))
}

/// Says that the test that runs is left out, for a test that shares its target with tests that need nothing: past the
/// harness, which keeps what a test prints, so that `.ci/totals` finds it. Elsewhere [`trials!`] says it better.
pub fn say_skipped(reason: &str) {
    let thread = std::thread::current();
    let test = thread.name().unwrap_or("a test");
    // Nobody can be told that nobody can be told.
    let _ = writeln!(std::io::stderr(), "skipped: {test}: {reason}");
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
