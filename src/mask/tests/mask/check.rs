//! `relit-mask check` on recordings of which the truth is known.

use std::fs;
use std::path::Path;

use image::{GrayImage, Luma};
use relit_test_support::{ffmpeg, is_named};
use serde_json::Value;

use super::support::{code, relit_mask, said};
use relit_test_support::disc::{HEIGHT, WIDTH};

/// A turn of 24 frames: a disc with its own pattern at (48, 32) before stripes that move.
fn turn(folder: &Path) {
    let mut bytes = format!("YUV4MPEG2 W{WIDTH} H{HEIGHT} F30:1 Ip A1:1 C444\n").into_bytes();
    for at in 0..24 {
        let luma = |x: u32, y: u32| {
            let (x, y) = (f64::from(x), f64::from(y));
            let pattern = 25.0 * (x * 0.5).sin() * (y * 0.4 + x * 0.1).cos();
            if (x - 48.0).hypot(y - 32.0) <= 18.0 {
                (180.0 + pattern) as u8
            } else {
                30 + 40 * ((x as u32 + 5 * at) / 10 % 4) as u8
            }
        };
        bytes.extend_from_slice(b"FRAME\n");
        bytes.extend((0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| luma(x, y))));
        bytes.extend(vec![128; (2 * WIDTH * HEIGHT) as usize]);
    }
    fs::write(folder.join("turn.y4m"), bytes).unwrap();
}

fn mask(folder: &Path, inside: impl Fn(f64, f64) -> bool) {
    let mask = GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        Luma([if inside(f64::from(x), f64::from(y)) {
            255
        } else {
            0
        }])
    });
    mask.save(folder.join("mask.png")).unwrap();
}

fn disc(x: f64, y: f64) -> bool {
    (x - 48.0).hypot(y - 32.0) <= 18.0
}

/// The exit code and the report.
fn check(folder: &Path) -> (i32, Value) {
    let output = relit_mask(folder, &["check", "turn.y4m", "--json"]);
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let event: Value = serde_json::from_str(&text).unwrap_or_else(|_| panic!("{}", said(&output)));
    (code(&output), event["report"].clone())
}

#[test]
fn a_mask_that_fits_is_said_to_fit_and_its_page_is_written() {
    let folder = tempfile::tempdir().unwrap();
    turn(folder.path());
    mask(folder.path(), disc);
    let (code, report) = check(folder.path());
    assert_eq!((code, &report["verdict"]), (0, &"fits".into()), "{report}");
    let page = fs::read_to_string(folder.path().join("mask-check.html")).unwrap();
    assert!(page.contains("class=\"verdict fits\"") && page.contains("data:image/jpeg;base64,"));
    assert!(!page.contains("<script"));
}

#[test]
fn a_mask_of_an_object_that_the_border_cuts_off_is_not_blamed_and_what_leaks_to_the_border_is() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let session =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/20261120T101500Z-cow-short");
    for (from, to) in [("video.mkv", "turn.avi"), ("mask_gt.png", "mask.png")] {
        let from = session.join(from);
        let options = ["-vf", "crop=270:360:210:0", "-q:v", "2", to];
        ffmpeg(
            path,
            &[&["-i", from.to_str().unwrap()][..], &options].concat(),
        );
    }
    let checked = || {
        let output = relit_mask(path, &["check", "turn.avi", "--mask", "mask.png", "--json"]);
        let event: Value = serde_json::from_slice(&output.stdout).unwrap();
        event["report"].clone()
    };
    let report = checked();
    assert_eq!(report["verdict"], "fits", "{report}");
    let mut mask = image::open(path.join("mask.png")).unwrap().into_luma8();
    for (_, _, pixel) in mask
        .enumerate_pixels_mut()
        .filter(|(x, y, _)| *x >= 202 && *y < 90)
    {
        *pixel = Luma([255]);
    }
    mask.save(path.join("mask.png")).unwrap();
    let report = checked();
    assert_eq!(report["verdict"], "wrong", "{report}");
    let leaks = report["shape"]["leaks"].as_array().unwrap();
    assert_eq!(leaks.len(), 1, "{report}");
    assert_eq!(leaks[0]["bounds"][0], 202);
}

#[test]
fn masks_of_another_shape_are_wrong_with_the_place_of_what_differs() {
    let folder = tempfile::tempdir().unwrap();
    turn(folder.path());
    let path = folder.path();
    let wrong = |inside: &dyn Fn(f64, f64) -> bool, list: &str| {
        mask(path, inside);
        let (code, report) = check(path);
        assert_eq!((code, &report["verdict"]), (3, &"wrong".into()), "{report}");
        let px = report["shape"][list][0]["px"].as_u64();
        assert!(px > Some(60), "{list}: {report}");
    };
    wrong(
        &|x, y| disc(x, y) || (70.0..85.0).contains(&x) && (20.0..40.0).contains(&y),
        "leaks",
    );
    wrong(&|x, y| disc(x, y) && x < 52.0, "missing");
    wrong(
        &|x, y| disc(x, y) && (x - 46.0).hypot(y - 32.0) > 6.0,
        "missing",
    );
}

#[test]
fn what_cannot_be_checked_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    turn(path);
    let failed = |named: &[&str]| {
        let output = relit_mask(path, &["check", "turn.y4m"]);
        assert_eq!(code(&output), 1);
        let named = [&["mask.png"], named].concat();
        assert!(is_named(&said(&output), &named), "{}", said(&output));
        assert_eq!(said(&output).lines().count(), 1);
    };
    failed(&["(os error 2)"]);
    fs::write(path.join("mask.png"), "painted").unwrap();
    failed(&[]);
    mask(path, |_, _| false);
    failed(&["0 of 255"]);
    GrayImage::new(9, 9).save(path.join("mask.png")).unwrap();
    failed(&["9 x 9"]);
    assert!(!path.join("mask-check.html").exists());
}
