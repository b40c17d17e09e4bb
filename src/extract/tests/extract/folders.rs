//! The program `relit-extract` on folders of clips with folders of masks, and on masks that do not fit.

use std::fs;
use std::path::Path;

use relit_data::shard::{Dataset, MaskMisfit, QualityVerdict};

use super::support::{BUST, COW, Place, fixture};

impl Place {
    fn copy(&self, from: &Path, to: &str) {
        let to = self.path(to);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(from, to).unwrap();
    }

    fn ids(&self, out: &str) -> Vec<String> {
        let dataset = Dataset::read(&self.path(out)).unwrap();
        dataset.sessions.into_iter().map(|entry| entry.id).collect()
    }
}

fn of_kind<'a>(events: &'a [serde_json::Value], kind: &str) -> Vec<&'a serde_json::Value> {
    let of_kind = events.iter().filter(|event| event["event"] == kind);
    of_kind.collect()
}

const SETTINGS: &str = "--frames 60 --size 32";

#[test]
fn the_mask_of_another_object_ends_with_3_however_little_differs() {
    let place = Place::new();
    let mask = fixture(BUST).join("mask_gt.png");
    let line = format!(
        "{} --mask {} {SETTINGS} -o out",
        fixture(COW).display(),
        mask.display()
    );
    let events = place.events(3, &line);
    let done = of_kind(&events, "done")[0];
    assert_eq!((&done["misfits"], &done["broken"]), (&1.into(), &1.into()));
    let dataset = Dataset::read(&place.path("out")).unwrap();
    let quality = &dataset.sessions[0].quality;
    assert_eq!(quality.mask_misfit, Some(MaskMisfit::AsAWhole));
    assert_eq!(quality.verdict, QualityVerdict::Broken);
    let events = place.events(3, &format!("{line} --resume"));
    assert_eq!(of_kind(&events, "skipped")[0]["broken"], true);
}

#[test]
fn a_mask_with_a_part_of_the_background_ends_with_3_and_leaves_the_session_usable() {
    let place = Place::new();
    let mut mask = image::open(fixture(COW).join("mask_gt.png"))
        .unwrap()
        .into_luma8();
    let bounds = relit_data::mask::bounding_box(&mask).unwrap();
    // A block beside the object, of about a twelfth of its area.
    let (left, top) = (bounds.right() as u32 + 6, bounds.y as u32 + bounds.h / 3);
    for y in top..top + 70 {
        for x in left..(left + 50).min(mask.width()) {
            mask.put_pixel(x, y, image::Luma([255]));
        }
    }
    mask.save(place.path("mask.png")).unwrap();
    let line = format!(
        "{} --mask mask.png {SETTINGS} -o out",
        fixture(COW).display()
    );
    let events = place.events(3, &line);
    let done = of_kind(&events, "done")[0];
    assert_eq!((&done["misfits"], &done["broken"]), (&1.into(), &0.into()));
    let dataset = Dataset::read(&place.path("out")).unwrap();
    let quality = &dataset.sessions[0].quality;
    assert_eq!(quality.mask_misfit, Some(MaskMisfit::InPart));
    assert_eq!(quality.verdict, QualityVerdict::Usable);
}

/// A folder of two clips and a folder of their masks.
fn clips() -> Place {
    let place = Place::new();
    for (name, clip) in [(COW, "cow"), (BUST, "the bust")] {
        place.copy(
            &fixture(name).join("video.mkv"),
            &format!("videos/{clip}.mkv"),
        );
        place.copy(
            &fixture(name).join("mask_gt.png"),
            &format!("masks/{clip}.png"),
        );
    }
    place
}

#[test]
fn a_folder_of_clips_with_a_folder_of_masks_is_like_a_folder_of_sessions() {
    let place = clips();
    let line = format!("videos/ --mask masks/ {SETTINGS} -o out");
    let events = place.events(0, &line);
    assert_eq!(of_kind(&events, "extracted").len(), 2);
    assert_eq!(place.ids("out"), ["cow", "the_bust"]);
    let report = relit_data::shard::verify(&place.path("out"), &|_, _| {}).unwrap();
    assert_eq!(report.problems, []);
    // Each has its own mask.
    let dataset = Dataset::read(&place.path("out")).unwrap();
    for (entry, mask) in dataset.sessions.iter().zip(["cow", "the bust"]) {
        let bytes = fs::read(place.path(format!("masks/{mask}.png"))).unwrap();
        assert_eq!(entry.mask.blake3, relit_data::shard::Digest::hash(&bytes));
    }
    let events = place.events(0, &format!("{line} --resume"));
    assert_eq!(of_kind(&events, "skipped").len(), 2);
}

#[test]
fn strays_and_damaged_files_among_clips_are_reported_and_end_no_run() {
    let place = clips();
    fs::write(place.path("videos/notes.txt"), "of the day").unwrap();
    fs::write(place.path("videos/torn.mp4"), "not a video").unwrap();
    fs::write(place.path("masks/torn.png"), "not a mask").unwrap();
    place.copy(&fixture(COW).join("video.mkv"), "videos/unmasked.mkv");
    let events = place.events(3, &format!("videos --mask masks {SETTINGS} -o out"));
    assert_eq!(place.ids("out"), ["cow", "the_bust"]);
    let inputs = |kind| -> Vec<String> {
        let of_kind = of_kind(&events, kind);
        let inputs = of_kind
            .iter()
            .map(|event| event["input"].as_str().unwrap().to_owned());
        inputs.collect()
    };
    assert_eq!(inputs("left_out"), ["videos/notes.txt"]);
    assert_eq!(inputs("error"), ["videos/torn.mp4", "videos/unmasked.mkv"]);
    let done = of_kind(&events, "done")[0];
    let counts = ["extracted", "left_out", "failed"].map(|count| done[count].as_u64());
    assert_eq!(counts, [Some(2), Some(1), Some(2)]);
}

#[test]
fn a_folder_of_one_clip_keeps_the_clips_name_and_masks_may_lie_beside_clips() {
    let place = Place::new();
    place.copy(&fixture(COW).join("video.mkv"), "videos/cow.mkv");
    place.copy(&fixture(COW).join("mask_gt.png"), "videos/cow-mask.png");
    place.events(0, &format!("videos --mask videos {SETTINGS} -o out"));
    assert_eq!(place.ids("out"), ["cow"]);
}

#[test]
fn every_event_names_its_session_and_totals_count_to_the_last() {
    let place = clips();
    fs::write(place.path("videos/torn.mp4"), "not a video").unwrap();
    let events = place.events(
        3,
        &format!("videos --mask masks {SETTINGS} -o out --progress"),
    );
    let sessions = ["cow", "the_bust", "torn"];
    for event in &events {
        let kind = event["event"].as_str().unwrap();
        if !["total", "done"].contains(&kind) {
            let session = event["session"].as_str().unwrap();
            assert!(sessions.contains(&session), "{event}");
        }
    }
    for kind in ["progress", "extracted", "error"] {
        assert!(!of_kind(&events, kind).is_empty(), "{kind}");
    }
    let totals = of_kind(&events, "total");
    let done: Vec<_> = totals.iter().map(|total| total["done"].as_u64()).collect();
    assert_eq!(done, [Some(1), Some(2), Some(3)]);
    assert!(totals.iter().all(|total| total["of"] == 3));
    assert_eq!(totals[2]["seconds_left"], 0);
    assert_eq!(events.last().unwrap()["event"], "done");
}
