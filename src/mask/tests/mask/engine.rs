//! `--engine`: relit's GrabCut, and OpenCV's as a reference, on two images.

use std::fs;
use std::path::Path;

use image::{GrayImage, Luma};
use relit_mask::MaskEngine;

use super::support::{clip, code, read, relit_mask, said};
use relit_test_support::disc::{AROUND, HEIGHT, WIDTH, in_disc};

/// Intersection over union of a mask and the ground truth.
fn iou(mask: &GrayImage, truth: &GrayImage) -> f64 {
    assert_eq!(mask.dimensions(), truth.dimensions());
    let pairs = || {
        mask.pixels()
            .zip(truth.pixels())
            .map(|(a, b)| (a.0[0] >= 128, b.0[0] >= 128))
    };
    let both = pairs().filter(|&(a, b)| a && b).count() as f64;
    both / pairs().filter(|&(a, b)| a || b).count() as f64
}

fn grey(bytes: &[u8]) -> GrayImage {
    image::load_from_memory(bytes).unwrap().into_luma8()
}

/// Makes a mask by an engine, and again from its record, to the same bytes; measures it.
fn check_engine(engine: &str, folder: &Path, input: &str, hints: &[&str], truth: &GrayImage) {
    let output = relit_mask(
        folder,
        &[
            &[input, "--engine", engine, "-o", "a.png", "--force"],
            hints,
        ]
        .concat(),
    );
    assert_eq!(code(&output), 0, "{}", said(&output));
    let share = iou(&grey(&read(folder, "a.png")), truth);
    assert!(share > 0.9, "{engine}, {input}: {share}");
    let record: serde_json::Value = serde_json::from_slice(&read(folder, "a.json")).unwrap();
    assert_eq!(record["engine"], engine);
    assert_eq!(
        record["software"].get("opencv").is_some(),
        engine == "opencv"
    );
    let arguments = [input, "--recipe", "a.json", "-o", "b.png", "--force"];
    let output = relit_mask(folder, &arguments);
    assert_eq!(code(&output), 0, "{}", said(&output));
    assert!(
        read(folder, "a.png") == read(folder, "b.png"),
        "{engine}, {input}"
    );
    assert_eq!(read(folder, "a.json"), read(folder, "b.json"));
}

#[test]
fn each_engine_finds_the_object_of_two_images_and_is_recorded() {
    let folder = clip();
    let fixture = Path::new("../../fixtures/20261120T093015Z-cow");
    for name in ["video.mkv", "seeds.png"] {
        fs::copy(fixture.join(name), folder.path().join(name)).unwrap();
    }
    let cow = grey(&read(fixture, "mask_gt.png"));
    let level = |x, y| Luma([if in_disc(x, y) { 255 } else { 0 }]);
    let disc = GrayImage::from_fn(WIDTH, HEIGHT, level);
    for (engine, name) in [(MaskEngine::Relit, "relit"), (MaskEngine::OpenCv, "opencv")] {
        if engine.is_built_in() {
            check_engine(name, folder.path(), "clip.y4m", &["--rect", AROUND], &disc);
            let both = ["--rect", "160,40,320,360", "--seeds", "seeds.png"];
            check_engine(name, folder.path(), "video.mkv", &both, &cow);
        }
    }
}

#[test]
fn opencv_makes_no_mask_by_a_turn_nor_in_the_editor() {
    let folder = clip();
    for other in ["--auto", "--edit"] {
        let output = relit_mask(folder.path(), &["clip.y4m", "--engine", "opencv", other]);
        assert_eq!(code(&output), 2, "{}", said(&output));
        assert!(said(&output).contains("--engine"), "{}", said(&output));
    }
}

#[cfg(not(feature = "opencv"))]
#[test]
fn a_program_without_opencv_says_in_one_sentence_how_to_build_it_in() {
    let folder = clip();
    fs::write(folder.path().join("mask.png"), "painted").unwrap();
    let output = relit_mask(
        folder.path(),
        &["clip.y4m", "--engine", "opencv", "--rect", AROUND],
    );
    assert_eq!(code(&output), 1);
    let said = said(&output);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("--features opencv"), "{said}");
    assert_eq!(read(folder.path(), "mask.png"), b"painted");
}

#[cfg(not(feature = "networks"))]
#[test]
fn a_program_without_networks_says_in_one_sentence_how_to_build_them_in() {
    let folder = clip();
    let output = relit_mask(folder.path(), &["clip.y4m", "--model", "net.onnx"]);
    assert_eq!(code(&output), 1);
    let said = said(&output);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("--features networks"), "{said}");
}
