//! The program `relit-mask`, and a folder with a small video.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use image::{Rgb, RgbImage};
use tempfile::TempDir;

use relit_test_support::disc::{HEIGHT, WIDTH, in_disc};

/// A video of three frames of the disc, as YUV4MPEG2: a container that needs no encoder.
pub(crate) fn video() -> Vec<u8> {
    let mut bytes = format!("YUV4MPEG2 W{WIDTH} H{HEIGHT} F30:1 Ip A1:1 C444\n").into_bytes();
    let luma = |x, y| {
        if in_disc(x, y) {
            210
        } else {
            30 + ((x + y) % 5) as u8
        }
    };
    for _ in 0..3 {
        bytes.extend_from_slice(b"FRAME\n");
        bytes.extend((0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| luma(x, y))));
        bytes.extend(vec![128; (2 * WIDTH * HEIGHT) as usize]);
    }
    bytes
}

/// A photograph of a disc of this radius on grey.
pub(crate) fn photograph(radius: f64) -> RgbImage {
    RgbImage::from_fn(96, 72, |x, y| {
        if (f64::from(x) - 48.0).hypot(f64::from(y) - 36.0) < radius {
            Rgb([220, 120, 40])
        } else {
            Rgb([40 + ((x * 7 + y * 3) % 6) as u8; 3])
        }
    })
}

pub(crate) fn relit_mask(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_relit-mask"))
        .current_dir(folder)
        .args(arguments)
        .output()
        .unwrap()
}

pub(crate) fn said(output: &Output) -> String {
    String::from_utf8_lossy(&[&output.stdout[..], &output.stderr].concat()).into_owned()
}

pub(crate) fn code(output: &Output) -> i32 {
    output
        .status
        .code()
        .unwrap_or_else(|| panic!("{}", said(output)))
}

/// A folder with `clip.y4m` in it.
pub(crate) fn clip() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("clip.y4m"), video()).unwrap();
    folder
}

pub(crate) fn read(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}
