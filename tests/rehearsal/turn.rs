//! Takes that come out well.

use std::path::{Path, PathBuf};

use relit_capture::state::{Check, Verdict};
use relit_data::session::Status;
use relit_data::shard::ImageSize;
use relit_extract::{ExtractOptions, extract};
use relit_video::{Muxer, PixelFormat, StreamFormat, Video};

use crate::support::{Rehearsal, SHORT, TURN, fixture};

/// Checks a whole take: so many frames, none lost, each with its angle. Gives its folder.
fn check_whole(rig: &mut Rehearsal, wanted: usize) -> std::path::PathBuf {
    let take = rig.capture().unwrap();
    assert_ne!(take.verdict, Verdict::Aborted, "{take:?}");
    assert_eq!((take.frames, take.dropped), (wanted as u64, 0));
    let session = rig.session(&take);
    assert_eq!(session.manifest.as_ref().unwrap().status, Status::Complete);
    let frames = session.frames.as_ref().unwrap();
    let simulator = rig.equipment.simulator().unwrap();
    let of_turn = &frames.entries()[frames.entries().len() - wanted..];
    let off = |at: usize| {
        let entry = &of_turn[at];
        (entry.angle_deg.unwrap() - simulator.angle_at(entry.t_us)).abs()
    };
    let mut errors: Vec<f64> = (0..wanted).map(off).collect();
    errors.sort_by(f64::total_cmp);
    let p99 = errors[wanted * 99 / 100];
    assert!(p99 <= 0.05, "p99 of the angles' errors: {p99}");
    let turned = of_turn[wanted - 1].angle_deg.unwrap() - of_turn[0].angle_deg.unwrap();
    let step = 360.0 / wanted as f64;
    assert!((turned.abs() - 360.0 + step).abs() < 0.05, "{turned}");
    assert!(rig.table_stands());
    rig.root.path().join(&take.session)
}

#[test]
fn a_turn_is_1500_frames_with_the_angles_that_the_table_had() {
    check_whole(&mut Rehearsal::whole(SHORT, ""), 1500);
}

#[test]
fn a_turn_of_raw_pictures_is_whole_and_can_be_extracted() {
    let mut rig = Rehearsal::with(TURN, "", "sim:?speed=0", |settings| {
        settings.degrees_per_second = 36.0;
    });
    let folder = check_whole(&mut rig, 300);
    let options = ExtractOptions {
        frames: 60,
        size: ImageSize::Pixels(64),
        mask: Some(fixture(TURN).join("mask_gt.png")),
        threads: 2,
        ..ExtractOptions::default()
    };
    let out = rig.root.path().join("out");
    let tally = extract(&[folder], &out, &options, &()).unwrap();
    assert_eq!((tally.extracted, tally.failed), (1, 0));
}

#[test]
fn a_camera_without_a_table_is_recorded_as_long_as_a_turn_takes() {
    let mut rig = Rehearsal::with(SHORT, "&speed=0", "none", |settings| {
        settings.degrees_per_second = 36.0;
    });
    let take = rig.capture().unwrap();
    assert_eq!(
        (take.verdict, take.frames),
        (Verdict::Clean, 300),
        "{take:?}"
    );
    let session = rig.session(&take);
    let frames = session.frames.unwrap();
    assert!(
        frames
            .entries()
            .iter()
            .all(|entry| entry.angle_deg.is_none())
    );
}

/// A video of a room that is the same all around: one frame of a session again and again.
fn even_room(folder: &Path) -> PathBuf {
    let video = Video::open(&fixture(SHORT).join("video.mkv")).unwrap();
    let first = video.packets().unwrap().next().unwrap();
    let (width, height) = video.coded_size();
    let stream = StreamFormat {
        format: PixelFormat::Mjpeg,
        width,
        height,
        fps: 30.0,
    };
    let path = folder.join("even.mkv");
    let mut muxer = Muxer::create(&path, stream).unwrap();
    for n in 0..30 {
        muxer.write(&first.data, 33_333 * n).unwrap();
    }
    muxer.finish().unwrap();
    path
}

/// What a take says about the room: whether it is good, and a sentence, which the take keeps if it is not.
fn room_check(rig: &mut Rehearsal) -> (bool, String) {
    let take = rig.capture().unwrap();
    assert_eq!(take.verdict, Verdict::Clean, "{take:?}");
    let manifest = rig.session(&take).manifest.unwrap();
    assert_eq!(manifest.notes(), take.notes);
    let checks = rig.monitor.state().checks;
    let check = checks.into_iter().find(|check| check.what == "light");
    let (good, found) = check.map(|check| (check.good, check.found)).unwrap();
    assert_eq!(take.notes.contains(&found), !good, "{:?}", take.notes);
    (good, found)
}

#[test]
fn a_take_keeps_what_its_camera_may_have_changed_by_itself() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["session.json", "frames.jsonl", "video.mkv"] {
        std::fs::copy(fixture(SHORT).join(name), folder.path().join(name)).unwrap();
    }
    let path = folder.path().join("session.json");
    let held = std::fs::read_to_string(&path).unwrap();
    let automatic = held.replace(
        "\"white_balance_automatic\": false",
        "\"white_balance_automatic\": true",
    );
    assert_ne!(held, automatic);
    std::fs::write(&path, automatic).unwrap();
    let recorded = folder.path().to_str().unwrap();
    let mut rig = Rehearsal::with(recorded, "", "sim:?speed=0", |settings| {
        settings.degrees_per_second = 36.0;
    });
    let take = rig.capture().unwrap();
    let checks = rig.monitor.state().checks;
    let of_camera = |check: &&Check| check.what == "camera settings" && !check.good;
    let noted: Vec<_> = checks.iter().filter(of_camera).collect();
    assert_eq!(noted.len(), 1, "{checks:?}");
    assert!(take.notes.contains(&noted[0].found), "{:?}", take.notes);
}

#[test]
fn a_take_says_whether_the_room_is_too_even() {
    let (good, found) = room_check(&mut Rehearsal::short("", |_| {}));
    assert!(good, "{found}");
    let folder = tempfile::tempdir().unwrap();
    let path = even_room(folder.path());
    let mut rig = Rehearsal::with(path.to_str().unwrap(), "", "sim:?speed=0", |settings| {
        settings.degrees_per_second = 36.0;
    });
    let (good, found) = room_check(&mut rig);
    assert!(!good, "{found}");
}
