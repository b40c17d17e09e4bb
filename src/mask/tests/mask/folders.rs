//! Several inputs at once: folders of clips and of photographs, and masks that are named after them.

use std::fs;
use std::path::Path;

use serde_json::Value;
use tempfile::TempDir;

use super::support::{code, photograph, read, relit_mask, said, video};
use relit_test_support::disc::AROUND;

const BOX: &str = "16,4,64,64";

/// A folder `photos` with two photographs.
fn photographs() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    for (name, radius) in [("bowl.png", 20.0), ("cup.png", 15.0)] {
        photograph(radius).save(photos.join(name)).unwrap();
    }
    folder
}

/// The names in a folder, sorted.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

fn events(output: &std::process::Output, kind: &str) -> Vec<Value> {
    let text = String::from_utf8_lossy(&output.stdout);
    let events = text.lines().map(|line| serde_json::from_str(line).unwrap());
    events
        .filter(|event: &Value| event["event"] == kind)
        .collect()
}

#[test]
fn each_clip_of_a_folder_gets_a_mask_of_its_name_and_strays_end_no_run() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let videos = path.join("videos");
    fs::create_dir(&videos).unwrap();
    for name in ["bowl.y4m", "my cup.y4m"] {
        fs::write(videos.join(name), video()).unwrap();
    }
    let line = ["videos/", "--rect", AROUND, "-o", "masks/", "--json"];
    let output = relit_mask(path, &line);
    assert_eq!(code(&output), 0, "{}", said(&output));
    let wanted = ["bowl", "my cup"]
        .map(|stem| ["-preview.png", ".json", ".png"].map(|ending| format!("{stem}{ending}")));
    assert_eq!(names(&path.join("masks")), wanted.concat());

    fs::write(videos.join("notes.txt"), "of the day").unwrap();
    fs::write(videos.join("torn.mp4"), "not a video").unwrap();
    let output = relit_mask(path, &line);
    assert_eq!(code(&output), 3, "{}", said(&output));
    assert_eq!(events(&output, "mask").len(), 2);
    assert_eq!(events(&output, "error")[0]["input"], "videos/torn.mp4");
    assert_eq!(events(&output, "left_out")[0]["input"], "videos/notes.txt");
}

#[test]
fn masks_that_were_made_by_hand_are_kept_and_are_no_failure() {
    let folder = photographs();
    let path = folder.path();
    let line = ["photos", "--rect", BOX, "-o", "masks", "--json"];
    assert_eq!(code(&relit_mask(path, &line)), 0);
    let by_hand = read(path, "masks/bowl.png");
    fs::write(path.join("masks/cup.png"), &by_hand).unwrap();
    let output = relit_mask(path, &line);
    assert_eq!(code(&output), 0, "{}", said(&output));
    assert_eq!(events(&output, "kept")[0]["input"], "photos/cup.png");
    let done = &events(&output, "done")[0];
    assert_eq!((&done["made"], &done["kept"]), (&1.into(), &1.into()));
    assert_eq!(read(path, "masks/cup.png"), by_hand);
    // Of a single input, it is the outcome.
    let one = ["photos/cup.png", "--rect", BOX, "-o", "masks/cup.png"];
    assert_eq!(code(&relit_mask(path, &one)), 1);
}

#[test]
fn no_input_is_overwritten_even_by_force() {
    let folder = photographs();
    let path = folder.path();
    let before = read(path, "photos/cup.png");
    let line = ["photos", "--rect", BOX, "-o", "photos", "--force"];
    assert_eq!(code(&relit_mask(path, &line)), 1);
    assert_eq!(read(path, "photos/cup.png"), before);
    fs::write(path.join("mask.png"), &before).unwrap();
    let line = ["mask.png", "--rect", BOX, "--force"];
    assert_eq!(code(&relit_mask(path, &line)), 1);
    assert_eq!(read(path, "mask.png"), before);

    // Where a preview would be.
    photograph(15.0).save(path.join("jug.jpg")).unwrap();
    fs::write(path.join("jug-preview.png"), &before).unwrap();
    let line = ["jug.jpg", "--rect", BOX, "-o", "jug.png"];
    assert_eq!(code(&relit_mask(path, &line)), 1);
    let line = [
        "jug.jpg",
        "jug-preview.png",
        "--rect",
        BOX,
        "-o",
        ".",
        "--force",
    ];
    assert_eq!(code(&relit_mask(path, &line)), 1);
    let line = [
        "jug.jpg",
        "--seeds",
        "jug-preview.png",
        "-o",
        "jug.png",
        "--force",
    ];
    assert_eq!(code(&relit_mask(path, &line)), 1);
    assert_eq!(read(path, "jug-preview.png"), before);
    assert!(!path.join("jug.json").exists());
}

#[test]
fn photographs_are_masked_again_beside_their_masks() {
    let folder = tempfile::tempdir().unwrap();
    let photos = folder.path().join("photos");
    fs::create_dir(&photos).unwrap();
    for name in ["bowl.jpg", "cup.jpg"] {
        photograph(15.0).save(photos.join(name)).unwrap();
    }
    for _ in 0..2 {
        let line = ["photos", "--rect", BOX, "-o", "photos", "--json"];
        let output = relit_mask(folder.path(), &line);
        assert_eq!(code(&output), 0, "{}", said(&output));
        assert_eq!(events(&output, "mask").len(), 2);
    }
}

#[test]
fn a_folder_of_one_clip_gives_a_mask_of_the_clips_name() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("videos")).unwrap();
    fs::write(folder.path().join("videos/cup.y4m"), video()).unwrap();
    let output = relit_mask(folder.path(), &["videos", "--rect", AROUND, "-o", "masks"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    assert!(folder.path().join("masks/cup.png").is_file());
}

#[test]
fn each_photograph_of_a_folder_gets_a_mask_of_its_name() {
    let folder = photographs();
    let path = folder.path();
    let output = relit_mask(path, &["photos", "--rect", BOX, "-o", "masks"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    let record: Value = serde_json::from_slice(&read(path, "masks/cup.json")).unwrap();
    assert_eq!(record["source"]["video"], "cup.png");
    assert!(read(path, "masks/cup.png") != read(path, "masks/bowl.png"));
}

#[test]
fn masks_in_the_working_folder_are_named_after_inputs_and_are_no_photographs_themselves() {
    let folder = photographs();
    let photos = folder.path().join("photos");
    for inputs in [&["bowl.png", "cup.png"][..], &["."]] {
        let output = relit_mask(&photos, &[inputs, &["--rect", BOX, "--json"]].concat());
        assert_eq!(code(&output), 0, "{}", said(&output));
        let masks = events(&output, "mask");
        let masks: Vec<&str> = masks
            .iter()
            .map(|mask| mask["mask"].as_str().unwrap())
            .collect();
        assert_eq!(masks, ["bowl-mask.png", "cup-mask.png"]);
    }
    assert_eq!(names(&photos).len(), 2 + 2 * 3);
}

#[test]
fn the_mask_of_another_photograph_is_replaced_only_with_force() {
    let folder = photographs();
    let photos = folder.path().join("photos");
    let mask = |name, more: &[&str]| {
        let line = [&[name, "--rect", BOX][..], more].concat();
        code(&relit_mask(&photos, &line))
    };
    assert_eq!(mask("bowl.png", &[]), 0);
    let of_bowl = read(&photos, "mask.png");
    assert_eq!(mask("cup.png", &[]), 1);
    assert!(read(&photos, "mask.png") == of_bowl);
    // Its own is made again, also where it has another name now.
    assert_eq!(mask("bowl.png", &[]), 0);
    fs::copy(photos.join("bowl.png"), photos.join("dish.png")).unwrap();
    assert_eq!(mask("dish.png", &[]), 0);
    assert_eq!(mask("cup.png", &["--force"]), 0);
    assert!(read(&photos, "mask.png") != of_bowl);
}

#[test]
fn of_two_inputs_of_one_name_the_second_is_refused_also_with_force() {
    let folder = photographs();
    let path = folder.path();
    fs::create_dir(path.join("others")).unwrap();
    photograph(10.0).save(path.join("others/Cup.png")).unwrap();
    let inputs = ["photos/cup.png", "others/Cup.png"];
    let more = ["--rect", BOX, "-o", "masks", "--force", "--json"];
    let output = relit_mask(path, &[&inputs[..], &more].concat());
    assert_eq!(code(&output), 3, "{}", said(&output));
    assert_eq!(events(&output, "error")[0]["input"], "others/Cup.png");
    let record: Value = serde_json::from_slice(&read(path, "masks/cup.json")).unwrap();
    assert_eq!(record["source"]["video"], "cup.png");
}

#[test]
fn a_check_takes_a_folder_of_clips_and_a_folder_of_masks() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    let session =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/20261120T101500Z-cow-short");
    for (from, to) in [
        ("video.mkv", "videos/cow.mkv"),
        ("mask_gt.png", "masks/cow.png"),
    ] {
        let to = path.join(to);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(session.join(from), to).unwrap();
    }
    let output = relit_mask(path, &["check", "videos", "--mask", "masks", "--json"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    assert_eq!(events(&output, "check")[0]["report"]["verdict"], "fits");
    assert!(path.join("masks/cow-check.html").is_file());
}
