//! The program `relit-mask` on recordings.

use std::fs;
use std::path::{Path, PathBuf};

use super::support::{clip, code, read, relit_mask, said, video};
use relit_test_support::disc::{AROUND, HEIGHT, WIDTH, disc_share, in_disc, seeds_image, strokes};
use relit_test_support::is_named;

#[test]
fn a_video_gets_mask_record_and_preview_in_the_working_folder() {
    let folder = clip();
    let output = relit_mask(
        folder.path(),
        &["clip.y4m", "--rect", AROUND, "--frame", "1"],
    );
    assert_eq!(code(&output), 0, "{}", said(&output));
    let mask = image::load_from_memory(&read(folder.path(), "mask.png")).unwrap();
    assert!(disc_share(mask.as_luma8().unwrap()) > 0.98);
    let preview = image::load_from_memory(&read(folder.path(), "mask-preview.png")).unwrap();
    assert_eq!(preview.to_rgb8().dimensions(), (WIDTH, HEIGHT));
    let record: serde_json::Value =
        serde_json::from_slice(&read(folder.path(), "mask.json")).unwrap();
    assert_eq!(record["schema"], "relit.mask/1");
    assert_eq!(record["source"]["frame"], 1);
    assert_eq!(record["source"]["video"], "clip.y4m");
    assert_eq!(record["hints"]["rect"], serde_json::json!([24, 8, 50, 48]));
    let hash = blake3::hash(&read(folder.path(), "mask.png")).to_hex();
    assert_eq!(record["result"]["mask_blake3"], hash.as_str());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 4);
}

#[test]
fn a_recipe_makes_the_same_files_again() {
    let folder = clip();
    let path = folder.path();
    seeds_image(strokes).save(path.join("seeds.png")).unwrap();
    let arguments = ["clip.y4m", "--seeds", "seeds.png", "-o", "a.png"];
    assert_eq!(code(&relit_mask(path, &arguments)), 0);
    fs::remove_file(path.join("seeds.png")).unwrap();
    let output = relit_mask(path, &["clip.y4m", "--recipe", "a.json", "-o", "b.png"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    for (first, second) in [
        ("a.png", "b.png"),
        ("a.json", "b.json"),
        ("a-preview.png", "b-preview.png"),
    ] {
        assert!(read(path, first) == read(path, second), "{second} differs");
    }
}

#[test]
fn a_recipe_of_another_frame_is_refused_unless_forced() {
    let folder = clip();
    let path = folder.path();
    assert_eq!(code(&relit_mask(path, &["clip.y4m", "--rect", AROUND])), 0);
    let mut other = video();
    let in_first_frame = other.len() / 6;
    other[in_first_frame] = 255;
    fs::write(path.join("other.y4m"), other).unwrap();
    let arguments = ["other.y4m", "--recipe", "mask.json", "-o", "other.png"];
    let output = relit_mask(path, &arguments);
    assert_eq!(code(&output), 1);
    assert!(said(&output).contains("--force"), "{}", said(&output));
    assert!(!path.join("other.png").exists());
    let forced = [&arguments[..], &["--force"]].concat();
    assert_eq!(code(&relit_mask(path, &forced)), 0);
}

#[test]
fn a_mask_that_can_be_made_again_is_replaced_and_a_painted_one_is_kept() {
    let folder = clip();
    let path = folder.path();
    assert_eq!(code(&relit_mask(path, &["clip.y4m", "--rect", AROUND])), 0);
    assert_eq!(
        code(&relit_mask(path, &["clip.y4m", "--rect", "20,6,56,52"])),
        0
    );
    seeds_image(strokes).save(path.join("mask.png")).unwrap();
    let painted = read(path, "mask.png");
    let output = relit_mask(path, &["clip.y4m", "--rect", AROUND]);
    assert_eq!(code(&output), 1);
    assert!(said(&output).contains("mask.png") && said(&output).contains("--force"));
    assert_eq!(read(path, "mask.png"), painted);
    assert_eq!(
        code(&relit_mask(
            path,
            &["clip.y4m", "--rect", AROUND, "--force"]
        )),
        0
    );
    assert_ne!(read(path, "mask.png"), painted);
}

/// Adds a stroke to the recipe in `folder` and makes its mask.
fn painted_mask(folder: &Path) -> serde_json::Value {
    assert_eq!(
        code(&relit_mask(folder, &["clip.y4m", "--rect", AROUND])),
        0
    );
    let mut record: serde_json::Value = serde_json::from_slice(&read(folder, "mask.json")).unwrap();
    record["hints"]["strokes"] =
        serde_json::json!([{ "brush": "background", "radius": 4.0, "points": [[48.5, 32.5]] }]);
    fs::write(folder.join("drawn.json"), record.to_string()).unwrap();
    let output = relit_mask(folder, &["clip.y4m", "--recipe", "drawn.json", "--force"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    serde_json::from_slice(&read(folder, "mask.json")).unwrap()
}

fn is_object(folder: &Path, x: u32, y: u32) -> bool {
    let mask = image::load_from_memory(&read(folder, "mask.png")).unwrap();
    mask.into_luma8().get_pixel(x, y).0[0] >= 128
}

#[test]
fn strokes_are_applied_to_the_mask_that_replaces_theirs_and_the_old_recipe_is_kept() {
    let folder = clip();
    let path = folder.path();
    let painted = painted_mask(path);
    assert!(!is_object(path, 48, 32));
    let old = read(path, "mask.json");
    let output = relit_mask(path, &["clip.y4m", "--rect", "22,6,54,52"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    assert!(
        is_named(&said(&output), &["1 stroke", "--force"]),
        "{}",
        said(&output)
    );
    assert!(!is_object(path, 48, 32), "the stroke is lost");
    let record: serde_json::Value = serde_json::from_slice(&read(path, "mask.json")).unwrap();
    assert_eq!(record["hints"]["strokes"], painted["hints"]["strokes"]);
    assert_eq!(record["hints"]["rect"], serde_json::json!([22, 6, 54, 52]));
    assert_eq!(read(path, "mask-previous.json"), old);

    // Forced, they are left out, and their recipe makes the mask again.
    let old = read(path, "mask.json");
    let output = relit_mask(path, &["clip.y4m", "--rect", AROUND, "--force"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    let kept = ["1 stroke", "mask-previous.json"];
    assert!(is_named(&said(&output), &kept), "{}", said(&output));
    assert!(is_object(path, 48, 32));
    assert_eq!(read(path, "mask-previous.json"), old);
    let arguments = [
        "clip.y4m",
        "--recipe",
        "mask-previous.json",
        "-o",
        "again.png",
    ];
    assert_eq!(code(&relit_mask(path, &arguments)), 0);
}

#[test]
fn strokes_of_another_recording_are_neither_applied_nor_lost() {
    let folder = clip();
    let path = folder.path();
    painted_mask(path);
    let old = read(path, "mask.json");
    let mut other = video();
    let in_first_frame = other.len() / 6;
    other[in_first_frame] = 255;
    fs::write(path.join("other.y4m"), other).unwrap();
    let output = relit_mask(path, &["other.y4m", "--rect", AROUND]);
    assert_eq!(code(&output), 1);
    assert!(
        is_named(&said(&output), &["mask.png", "--force"]),
        "{}",
        said(&output)
    );
    assert_eq!(read(path, "mask.json"), old);
}

#[test]
fn another_file_is_never_overwritten_by_the_record() {
    let folder = clip();
    let path = folder.path();
    fs::write(
        path.join("session.json"),
        r#"{"schema": "relit.session/1"}"#,
    )
    .unwrap();
    let arguments = ["clip.y4m", "--rect", AROUND, "-o", "session.png", "--force"];
    let output = relit_mask(path, &arguments);
    assert_eq!(code(&output), 1);
    assert!(
        said(&output).contains("relit.session/1"),
        "{}",
        said(&output)
    );
}

#[test]
fn wrong_usage_exits_with_2() {
    let folder = clip();
    let path = folder.path();
    let wrong: [&[&str]; 6] = [
        &["clip.y4m"],
        &["check"],
        &["clip.y4m", "--recipe", "mask.json", "--auto"],
        &["clip.y4m", "--rect", "1,2,3"],
        &["clip.y4m", "--rect", AROUND, "-o", "mask.jpg"],
        &["clip.y4m", "--recipe", "mask.json", "--rect", AROUND],
    ];
    for arguments in wrong {
        assert_eq!(code(&relit_mask(path, arguments)), 2, "{arguments:?}");
    }
    assert!(!path.join("mask.png").exists());
}

#[test]
fn a_failure_exits_with_1_and_leaves_no_mask() {
    let folder = clip();
    let path = folder.path();
    seeds_image(|_, _| 0).save(path.join("black.png")).unwrap();
    let failed: [&[&str]; 7] = [
        &["clip.y4m", "--auto"],
        &["nothing.mkv", "--rect", AROUND],
        &["clip.y4m", "--rect", AROUND, "--frame", "3"],
        &["clip.y4m", "--rect=-50,0,10,10"],
        &["clip.y4m", "--seeds", "black.png"],
        &["clip.y4m", "--seeds", "clip.y4m"],
        &["clip.y4m", "--recipe", "nothing.json"],
    ];
    for arguments in failed {
        let output = relit_mask(path, arguments);
        assert_eq!(code(&output), 1, "{arguments:?}");
        assert_eq!(said(&output).lines().count(), 1, "{}", said(&output));
    }
    assert!(!path.join("mask.png").exists());
}

#[test]
fn a_frame_beyond_the_end_is_reported_with_the_last_one() {
    let folder = clip();
    let output = relit_mask(
        folder.path(),
        &["clip.y4m", "--rect", AROUND, "--frame", "3"],
    );
    assert!(
        is_named(&said(&output), &["clip.y4m", "3", "0", "2"]),
        "{}",
        said(&output)
    );
}

/// A turn of 16 frames: the disc before stripes that move.
pub(crate) fn turn_video() -> Vec<u8> {
    let mut bytes = format!("YUV4MPEG2 W{WIDTH} H{HEIGHT} F30:1 Ip A1:1 C444\n").into_bytes();
    for at in 0..16 {
        let luma = |x: u32, y: u32| {
            if in_disc(x, y) {
                200 + ((x + y) % 3) as u8
            } else {
                30 + 60 * ((x + 5 * at) / 10 % 4) as u8
            }
        };
        bytes.extend_from_slice(b"FRAME\n");
        bytes.extend((0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| luma(x, y))));
        bytes.extend(vec![128; (2 * WIDTH * HEIGHT) as usize]);
    }
    bytes
}

#[test]
fn auto_needs_no_hint_and_its_recipe_makes_the_same_files_again() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    fs::write(path.join("turn.y4m"), turn_video()).unwrap();
    let output = relit_mask(path, &["turn.y4m", "--auto", "-o", "a.png"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    let mask = image::load_from_memory(&read(path, "a.png")).unwrap();
    let share = disc_share(mask.as_luma8().unwrap());
    assert!(share > 0.9, "{share}");
    let record: serde_json::Value = serde_json::from_slice(&read(path, "a.json")).unwrap();
    assert_eq!(record["hints"]["turn_frames"].as_array().unwrap().len(), 16);
    let output = relit_mask(path, &["turn.y4m", "--recipe", "a.json", "-o", "b.png"]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    for (first, second) in [("a.png", "b.png"), ("a.json", "b.json")] {
        assert!(read(path, first) == read(path, second), "{second} differs");
    }
}

/// A session folder `<name>` in `root` with the disc as its video.
pub(crate) fn session(root: &Path, name: &str) -> PathBuf {
    let folder = root.join(name);
    fs::create_dir(&folder).unwrap();
    let video = video();
    let manifest = serde_json::json!({
        "schema": "relit.session/1", "id": name, "object": "disc",
        "created": "2026-11-20T09:30:15Z", "status": "complete", "reason": null,
        "camera": {
            "backend": "replay", "device": "disc", "name": "disc", "fourcc": "I444",
            "width": WIDTH, "height": HEIGHT, "fps": 30.0, "controls": {},
        },
        "turntable": null,
        "video": {
            "file": "video.y4m", "codec": "rawvideo", "frames": 3,
            "bytes": video.len(), "blake3": blake3::hash(&video).to_hex().as_str(),
        },
        "faults": [],
        "software": { "version": "0.1.0", "commit": "unknown" },
    });
    fs::write(folder.join("session.json"), manifest.to_string()).unwrap();
    let line = |n: u64| {
        let t_us = n * 33_333;
        serde_json::json!({ "n": n, "sequence": n, "t_us": t_us, "angle_deg": null }).to_string()
    };
    let index: String = (0..3).map(|n| line(n) + "\n").collect();
    fs::write(folder.join("frames.jsonl"), index).unwrap();
    fs::write(folder.join("video.y4m"), video).unwrap();
    folder
}

#[test]
fn each_session_of_a_folder_gets_its_mask_and_a_failing_one_stops_no_other() {
    let root = tempfile::tempdir().unwrap();
    let names = [
        "20261120T093015Z-a",
        "20261120T093115Z-b",
        "20261120T093215Z-c",
    ];
    let folders = names.map(|name| session(root.path(), name));
    fs::write(folders[1].join("video.y4m"), "torn").unwrap();
    let output = relit_mask(root.path(), &[".", "--rect", AROUND, "--json"]);
    assert_eq!(code(&output), 3, "{}", said(&output));
    assert!(folders[0].join("mask.json").is_file());
    assert!(!folders[1].join("mask.png").exists());
    assert!(folders[2].join("mask-preview.png").is_file());
    let events = String::from_utf8(output.stdout).unwrap();
    let events: Vec<serde_json::Value> = events
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let (totals, events): (Vec<_>, Vec<_>) = events
        .into_iter()
        .partition(|event| event["event"] == "total");
    assert_eq!(totals.len(), 3);
    let kinds: Vec<_> = events.iter().map(|event| event["event"].clone()).collect();
    assert_eq!(kinds, ["mask", "error", "mask", "done"]);
    assert_eq!(events[0]["session"], names[0]);
    assert_eq!(events[1]["session"], names[1]);
}

#[test]
fn what_lies_beside_sessions_is_named_whether_or_not_a_mask_fails() {
    let root = tempfile::tempdir().unwrap();
    session(root.path(), "20261120T093015Z-a");
    let failing = session(root.path(), "20261120T093115Z-b");
    fs::write(root.path().join("notes.txt"), "of the day").unwrap();
    for painted in [false, true] {
        if painted {
            fs::write(failing.join("mask.png"), "painted").unwrap();
        }
        let output = relit_mask(root.path(), &[".", "--rect", AROUND]);
        assert_eq!(code(&output), 3, "{}", said(&output));
        assert!(said(&output).contains("notes.txt"), "{}", said(&output));
    }
}

#[test]
fn one_name_for_the_masks_of_several_sessions_is_a_usage_error() {
    let root = tempfile::tempdir().unwrap();
    session(root.path(), "20261120T093015Z-a");
    session(root.path(), "20261120T093115Z-b");
    let output = relit_mask(root.path(), &[".", "--rect", AROUND, "-o", "mask.png"]);
    assert_eq!(code(&output), 2);
    assert!(!root.path().join("mask.png").exists());
}

#[test]
fn a_session_gets_its_mask_in_its_folder() {
    let root = tempfile::tempdir().unwrap();
    let folder = session(root.path(), "20261120T093015Z-a");
    let output = relit_mask(root.path(), &["20261120T093015Z-a", "--rect", AROUND]);
    assert_eq!(code(&output), 0, "{}", said(&output));
    for name in ["mask.png", "mask.json", "mask-preview.png"] {
        assert!(folder.join(name).is_file(), "{name}");
    }
}
