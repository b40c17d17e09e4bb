//! `--model`: the object is what a network finds.

mod files;
mod hostile;

use std::fs;
use std::path::Path;

use image::{Rgb, RgbImage};
use relit_test_support::disc::{AROUND, HEIGHT, WIDTH, disc_share, in_disc};
use serde_json::Value;
use tempfile::TempDir;

use super::support::{clip, code, read, relit_mask, said};
use files::{birefnet, decoder, efficient_sam, encoder, u2netp};

/// The disc on a background whose colours are no help.
fn disc() -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| {
        let level = if in_disc(x, y) { 215 } else { 30 };
        Rgb([level, level, level - ((x * 7 + y * 5) % 9) as u8])
    })
}

/// A folder with the disc as `disc.png`, and networks.
fn folder_with(networks: &[(&str, Vec<u8>)]) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    disc().save(folder.path().join("disc.png")).unwrap();
    for (name, bytes) in networks {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    folder
}

fn record(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&read(folder, name)).unwrap()
}

fn share(folder: &Path, name: &str) -> f64 {
    let mask = image::load_from_memory(&read(folder, name)).unwrap();
    disc_share(&mask.into_luma8())
}

#[test]
fn the_object_of_a_photograph_and_of_a_video_is_what_the_network_finds() {
    let folder = clip();
    let folder = folder.path();
    disc().save(folder.join("disc.png")).unwrap();
    fs::write(folder.join("net.onnx"), u2netp()).unwrap();
    fs::write(folder.join("large.onnx"), birefnet()).unwrap();
    for (input, net) in [
        ("disc.png", "net.onnx"),
        ("clip.y4m", "net.onnx"),
        ("disc.png", "large.onnx"),
    ] {
        let arguments = [input, "--model", net, "-o", "mask.png", "--force"];
        let done = relit_mask(folder, &arguments);
        assert_eq!(code(&done), 0, "{}", said(&done));
        let found = share(folder, "mask.png");
        assert!(found > 0.97, "{input} {net}: {found}");
        let network = &record(folder, "mask.json")["network"];
        let hash = blake3::hash(&read(folder, net)).to_hex().to_string();
        assert_eq!(network["files"][0]["name"], net);
        assert_eq!(network["files"][0]["blake3"], hash);
        assert!(network.get("rect").is_none());
    }
}

#[test]
fn a_recipe_makes_the_mask_again_without_the_network() {
    let folder = folder_with(&[("net.onnx", u2netp())]);
    let folder = folder.path();
    let done = relit_mask(folder, &["disc.png", "--model", "net.onnx"]);
    assert_eq!(code(&done), 0, "{}", said(&done));
    fs::remove_file(folder.join("net.onnx")).unwrap();
    let again = ["disc.png", "--recipe", "mask.json", "-o", "again.png"];
    let done = relit_mask(folder, &again);
    assert_eq!(code(&done), 0, "{}", said(&done));
    assert_eq!(read(folder, "mask.png"), read(folder, "again.png"));
    assert_eq!(record(folder, "mask.json"), record(folder, "again.json"));
}

#[test]
fn a_rectangle_says_which_of_two_objects_is_meant() {
    let folder = folder_with(&[("net.onnx", u2netp())]);
    let folder = folder.path();
    let mut two = RgbImage::from_pixel(400, 200, Rgb([20, 22, 25]));
    for (x, y, pixel) in two.enumerate_pixels_mut() {
        let near =
            |left: f64, radius: f64| (f64::from(x) - left).hypot(f64::from(y) - 100.0) < radius;
        if near(110.0, 70.0) || near(300.0, 30.0) {
            *pixel = Rgb([230, 225, 215]);
        }
    }
    two.save(folder.join("two.png")).unwrap();
    let mut found = Vec::new();
    for hints in [&[][..], &["--rect", "240,40,120,120"], &["--keep-all"]] {
        let arguments = [&["two.png", "--model", "net.onnx"][..], hints].concat();
        let done = relit_mask(folder, &arguments);
        assert_eq!(code(&done), 0, "{}", said(&done));
        let record = record(folder, "mask.json");
        assert_eq!(record["network"].get("rect").is_some(), hints.len() == 2);
        found.push(record["result"]["area_px"].as_u64().unwrap());
    }
    let discs = [70.0, 30.0].map(|radius: f64| (std::f64::consts::PI * radius * radius) as u64);
    for (found, expected) in found.iter().zip([discs[0], discs[1], discs[0] + discs[1]]) {
        assert!(
            found.abs_diff(expected) < expected / 50,
            "{found} {expected}"
        );
    }
}

#[test]
fn seeds_correct_what_the_network_finds() {
    let folder = folder_with(&[("net.onnx", u2netp())]);
    let folder = folder.path();
    let seeds = image::GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
        image::Luma([if x.abs_diff(48) < 6 && y.abs_diff(32) < 6 {
            0
        } else {
            128
        }])
    });
    seeds.save(folder.join("seeds.png")).unwrap();
    let arguments = ["disc.png", "--model", "net.onnx", "--seeds", "seeds.png"];
    let done = relit_mask(folder, &arguments);
    assert_eq!(code(&done), 0, "{}", said(&done));
    let mask = image::load_from_memory(&read(folder, "mask.png"))
        .unwrap()
        .into_luma8();
    assert_eq!(mask.get_pixel(48, 32).0, [0]);
    assert_eq!(mask.get_pixel(48, 20).0, [255]);
}

#[test]
fn strokes_of_an_earlier_mask_are_applied_to_what_the_network_finds() {
    let folder = folder_with(&[("net.onnx", u2netp())]);
    let folder = folder.path();
    let arguments = ["disc.png", "--model", "net.onnx"];
    assert_eq!(code(&relit_mask(folder, &arguments)), 0);
    let mut painted = record(folder, "mask.json");
    let stroke =
        serde_json::json!({"brush": "background", "radius": 5.0, "points": [[48.0, 32.0]]});
    painted["hints"]["strokes"] = serde_json::json!([stroke]);
    fs::write(folder.join("mask.json"), painted.to_string()).unwrap();
    let done = relit_mask(folder, &arguments);
    assert_eq!(code(&done), 0, "{}", said(&done));
    let mask = image::load_from_memory(&read(folder, "mask.png"))
        .unwrap()
        .into_luma8();
    assert_eq!(mask.get_pixel(48, 32).0, [0]);
    assert_eq!(mask.get_pixel(48, 20).0, [255]);
    let found = record(folder, "mask.json");
    assert_eq!(found["network"], painted["network"]);
    assert_eq!(found["hints"]["strokes"], painted["hints"]["strokes"]);
}

#[test]
fn in_a_folder_a_photograph_in_which_nothing_is_found_has_no_mask() {
    let folder = folder_with(&[("net.onnx", u2netp())]);
    let folder = folder.path();
    fs::create_dir(folder.join("photographs")).unwrap();
    disc().save(folder.join("photographs/disc.png")).unwrap();
    let dark = RgbImage::from_pixel(80, 60, Rgb([12, 14, 13]));
    dark.save(folder.join("photographs/dark.png")).unwrap();
    let all = [
        "photographs",
        "--model",
        "net.onnx",
        "-o",
        "masks/",
        "--json",
    ];
    let done = relit_mask(folder, &all);
    assert_eq!(code(&done), 3, "{}", said(&done));
    assert!(share(folder, "masks/disc.png") > 0.97);
    assert!(!folder.join("masks/dark.png").exists());
    let lines = String::from_utf8_lossy(&done.stdout).into_owned();
    let events = lines
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap());
    let failed: Vec<Value> = events.filter(|event| event["event"] == "error").collect();
    assert_eq!(failed.len(), 1);
    assert_eq!(failed[0]["session"], "dark");
    let one = [
        "photographs/dark.png",
        "--model",
        "net.onnx",
        "-o",
        "dark.png",
    ];
    let done = relit_mask(folder, &one);
    assert_eq!(code(&done), 1, "{}", said(&done));
    assert!(!folder.join("dark.png").exists());
}

#[test]
fn a_network_in_one_file_is_asked_with_the_box_in_its_own_picture() {
    // The frame of 96 x 64 is stretched to 1024 x 1024.
    let corners =
        [24.0 / 96.0, 8.0 / 64.0, 74.0 / 96.0, 56.0 / 64.0].map(|share: f32| 1024.0 * share);
    let folder = folder_with(&[("net.onnx", efficient_sam(&corners, &[2.0, 3.0]))]);
    let folder = folder.path();
    let done = relit_mask(
        folder,
        &["disc.png", "--model", "net.onnx", "--rect", AROUND],
    );
    assert_eq!(code(&done), 0, "{}", said(&done));
    assert!(share(folder, "mask.png") > 0.97);
    let other = [
        "disc.png",
        "--model",
        "net.onnx",
        "--rect",
        "20,8,50,48",
        "-o",
        "other.png",
    ];
    assert_eq!(code(&relit_mask(folder, &other)), 1);
}

#[test]
fn an_encoder_and_its_decoder_are_told_apart_and_asked_with_a_box_or_a_point() {
    // The frame of 96 x 64 is enlarged to 1024 x 683.
    let scale = 1024.0 / 96.0;
    let corners = [24.0, 8.0, 74.0, 56.0].map(|side: f32| scale * side);
    let middle = [48.5 * scale, 32.5 * scale, 0.0, 0.0];
    let folder = folder_with(&[
        ("encoder.onnx", encoder()),
        ("box.onnx", decoder(&corners, &[2.0, 3.0])),
        ("point.onnx", decoder(&middle, &[1.0, -1.0])),
    ]);
    let folder = folder.path();
    let mut seeds = image::GrayImage::from_pixel(WIDTH, HEIGHT, image::Luma([128]));
    seeds.put_pixel(48, 32, image::Luma([255]));
    seeds.save(folder.join("seeds.png")).unwrap();
    let first = [
        "disc.png",
        "--model",
        "encoder.onnx",
        "--model",
        "box.onnx",
        "--rect",
        AROUND,
    ];
    let last = [
        "disc.png",
        "--model",
        "box.onnx",
        "--model",
        "encoder.onnx",
        "--rect",
        AROUND,
    ];
    for arguments in [first, last] {
        let done = relit_mask(folder, &arguments);
        assert_eq!(code(&done), 0, "{}", said(&done));
        assert!(share(folder, "mask.png") > 0.97);
        let record = record(folder, "mask.json");
        let files = record["network"]["files"].as_array().unwrap();
        assert_eq!(files.len(), 2);
        assert_eq!(
            record["network"]["rect"],
            serde_json::json!([24, 8, 50, 48])
        );
    }
    // Of the four masks a point gets another one than a box.
    let point = [
        "disc.png",
        "--model",
        "encoder.onnx",
        "--model",
        "point.onnx",
        "--seeds",
        "seeds.png",
    ];
    let done = relit_mask(folder, &[&point[..], &["-o", "point.png"]].concat());
    assert_eq!(code(&done), 0, "{}", said(&done));
    assert!(share(folder, "point.png") < 0.1);
}

#[test]
fn a_network_that_needs_a_prompt_asks_for_it() {
    let folder = folder_with(&[("net.onnx", efficient_sam(&[0.0; 4], &[2.0, 3.0]))]);
    let done = relit_mask(folder.path(), &["disc.png", "--model", "net.onnx"]);
    assert_eq!(code(&done), 1, "{}", said(&done));
    assert_eq!(said(&done).lines().count(), 1, "{}", said(&done));
    assert!(said(&done).contains("--rect") && said(&done).contains("--seeds"));
}

#[test]
fn a_network_goes_with_no_other_way_to_find_the_object() {
    let folder = folder_with(&[("net.onnx", u2netp())]);
    for other in [&["--auto"][..], &["--edit"], &["--recipe", "mask.json"]] {
        let arguments = [&["disc.png", "--model", "net.onnx"], other].concat();
        let done = relit_mask(folder.path(), &arguments);
        assert_eq!(code(&done), 2, "{other:?}: {}", said(&done));
    }
    let three = ["disc.png", "--model", "a", "--model", "b", "--model", "c"];
    assert_eq!(code(&relit_mask(folder.path(), &three)), 2);
}
