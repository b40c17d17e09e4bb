//! Session folders: written, read back, and damaged in many ways.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use proptest::prelude::*;
use relit_data::rig::{RigFacts, RotationDirection};
use relit_data::session::{
    CameraFacts, FrameClock, FrameEntry, FrameIndex, Manifest, Notice, Recording, SessionError,
    SessionWriter, SoftwareFacts, Status, TurntableFacts, VideoFacts, beside_recordings, clips,
    hidden_recordings, object_of, recordings,
};
use tempfile::TempDir;

const ID: &str = "20261120T093015Z-mug";

fn manifest() -> Manifest {
    Manifest {
        id: ID.to_owned(),
        object: "mug".to_owned(),
        created: "2026-11-20T09:30:15Z".parse().unwrap(),
        status: Status::Recording,
        camera: CameraFacts {
            backend: "v4l2".to_owned(),
            device: "/dev/video0".to_owned(),
            name: "Camera".to_owned(),
            fourcc: "MJPG".to_owned(),
            width: 640,
            height: 480,
            fps: 30.0,
            clock: FrameClock::default(),
            controls: BTreeMap::from([("gain".to_owned(), 4.into())]),
        },
        turntable: Some(TurntableFacts {
            port: "/dev/ttyUSB0".to_owned(),
            firmware: "Grbl 1.1h".to_owned(),
            degrees_per_second: 7.2,
            steps_per_degree: 88.889,
        }),
        rig: None,
        video: VideoFacts {
            file: "video.mkv".to_owned(),
            codec: "mjpeg".to_owned(),
            frames: None,
            bytes: None,
            blake3: None,
        },
        faults: Vec::new(),
        software: SoftwareFacts {
            version: "1".to_owned(),
            commit: String::new(),
        },
        note: None,
        rating: None,
    }
}

fn entry(n: u64) -> FrameEntry {
    FrameEntry {
        n,
        sequence: n,
        t_us: 33_333 * n as i64,
        angle_deg: Some(0.24 * n as f64),
    }
}

/// A whole session of ten frames, whose video is not one: nothing here looks into it.
fn whole() -> (TempDir, PathBuf) {
    let root = tempfile::tempdir().unwrap();
    let mut writer = SessionWriter::create(root.path(), manifest()).unwrap();
    fs::write(writer.video_path(), b"ten frames").unwrap();
    (0..10).for_each(|n| writer.push(entry(n)).unwrap());
    let folder = writer.folder().to_owned();
    writer.finish().unwrap();
    (root, folder)
}

fn edit(folder: &Path, from: &str, to: &str) {
    let path = folder.join("session.json");
    let text = fs::read_to_string(&path).unwrap();
    assert!(text.contains(from), "{text}");
    fs::write(path, text.replacen(from, to, 1)).unwrap();
}

fn losses(recording: &Recording) -> Vec<&str> {
    recording
        .notices
        .iter()
        .filter(|n| n.is_loss())
        .map(Notice::text)
        .collect()
}

#[test]
fn a_session_is_read_as_it_was_written() {
    let (_root, folder) = whole();
    let recording = Recording::open(&folder).unwrap();
    assert_eq!(
        (recording.id.as_str(), recording.object.as_str()),
        (ID, "mug")
    );
    assert!(recording.notices.is_empty(), "{:?}", recording.notices);
    let read = recording.manifest.unwrap();
    assert_eq!(read.status, Status::Complete);
    assert_eq!((read.video.frames, read.video.bytes), (Some(10), Some(10)));
    assert_eq!(read.camera, manifest().camera);
    assert_eq!(
        recording.frames.unwrap().entries(),
        (0..10).map(entry).collect::<Vec<_>>()
    );
}

#[test]
fn what_is_known_of_the_rig_comes_back_and_nothing_is_written_of_one_that_is_not_known() {
    let unknown = String::from_utf8(manifest().to_json().unwrap()).unwrap();
    assert!(!unknown.contains("rig"), "{unknown}");
    let with = |rig: &str| {
        let json = unknown.replace("\"video\":", &format!("\"rig\": {rig}, \"video\":"));
        Manifest::from_json(json.as_bytes())
    };
    assert_eq!(with("null").unwrap().rig, None);
    let read = with(r#"{"rotation": "clockwise", "camera_elevation_deg": 21.5}"#).unwrap();
    let rig = RigFacts {
        rotation: Some(RotationDirection::Clockwise),
        camera_elevation_deg: Some(21.5),
    };
    assert_eq!(read.rig, Some(rig));
    assert_eq!(Manifest::from_json(&read.to_json().unwrap()).unwrap(), read);
    let half = with(r#"{"rotation": null}"#).unwrap().rig;
    assert_eq!(half, Some(RigFacts::default()));
    let refused = with(r#"{"camera_elevation_deg": 95.0}"#);
    assert!(refused.is_err_and(|fault| fault.contains("camera_elevation_deg")));
}

#[test]
fn a_manifest_names_the_clock_only_where_it_is_not_the_drivers() {
    let driver = manifest();
    let text = String::from_utf8(driver.to_json().unwrap()).unwrap();
    assert!(!text.contains("clock"), "{text}");
    assert_eq!(Manifest::from_json(text.as_bytes()).unwrap(), driver);
    let mut host = manifest();
    host.camera.clock = FrameClock::Host;
    let text = String::from_utf8(host.to_json().unwrap()).unwrap();
    assert!(text.contains("\"clock\": \"host\""), "{text}");
    assert_eq!(Manifest::from_json(text.as_bytes()).unwrap(), host);
}

/// That a session cannot be used, and that this is named.
#[track_caller]
fn refused<T>(result: Result<T, SessionError>, named: &str) {
    match result {
        Err(SessionError::Unusable(text)) => assert!(text.contains(named), "{text}"),
        Err(other) => panic!("{other:?}"),
        Ok(_) => panic!("it was taken"),
    }
}

#[test]
fn a_session_is_marked_as_recording_until_it_ends() {
    let root = tempfile::tempdir().unwrap();
    let mut writer = SessionWriter::create(root.path(), manifest()).unwrap();
    fs::write(writer.video_path(), b"some").unwrap();
    writer.push(entry(0)).unwrap();
    let folder = writer.folder().to_owned();
    refused(Recording::open(&folder), ID);
    writer.abort("the camera was unplugged").unwrap();
    let recording = Recording::open(&folder).unwrap();
    assert_eq!(losses(&recording).len(), 1);
    assert!(losses(&recording)[0].contains("the camera was unplugged"));
    let status = recording.manifest.unwrap().status;
    assert_eq!(
        status,
        Status::Aborted("the camera was unplugged".to_owned())
    );
}

#[test]
fn a_capture_that_failed_before_its_first_frame_can_be_aborted() {
    let root = tempfile::tempdir().unwrap();
    let writer = SessionWriter::create(root.path(), manifest()).unwrap();
    let ended = writer.abort("no frame came").unwrap();
    assert_eq!(ended.status, Status::Aborted("no frame came".to_owned()));
}

#[test]
fn a_session_never_replaces_another_one() {
    let (root, folder) = whole();
    let before = fs::read(folder.join("session.json")).unwrap();
    refused(SessionWriter::create(root.path(), manifest()), ID);
    let mut outside = manifest();
    outside.id = "../mug".to_owned();
    refused(SessionWriter::create(root.path(), outside), "../mug");
    assert_eq!(fs::read(folder.join("session.json")).unwrap(), before);
}

#[test]
fn an_entry_that_does_not_follow_is_refused_and_leaves_the_index_whole() {
    let root = tempfile::tempdir().unwrap();
    let mut writer = SessionWriter::create(root.path(), manifest()).unwrap();
    writer.push(entry(0)).unwrap();
    refused(writer.push(entry(2)), "frame 2 ");
    writer.push(entry(1)).unwrap();
    let text = fs::read(writer.folder().join("frames.jsonl")).unwrap();
    assert_eq!(FrameIndex::parse(&text).unwrap().entries().len(), 2);
}

#[test]
fn what_is_wrong_in_a_manifest_is_named() {
    for (from, to, named) in [
        ("relit.session/1", "relit.session/2", "\"relit.session/2\""),
        ("\"complete\"", "\"finished\"", "`finished`"),
        ("\"complete\"", "\"aborted\"", "`reason`"),
        ("\"width\": 640", "\"width\": \"wide\"", "line"),
        ("\"bytes\": 10", "\"bytes\": null", "video.bytes"),
        ("\"video.mkv\"", "\"../video.mkv\"", "../video.mkv"),
        ("\"fps\": 30.0", "\"fps\": 0.0", "camera.fps"),
        (ID, "a/b", "a/b"),
        ("\"mug\"", "\" \"", "object"),
        ("{", "", "line"),
    ] {
        let (_root, folder) = whole();
        edit(&folder, from, to);
        let message = Recording::open(&folder).unwrap_err().to_string();
        assert!(
            message.contains(named) && message.contains("session.json"),
            "{to}: {message}"
        );
    }
}

#[test]
fn a_truncated_video_is_a_loss() {
    let (_root, folder) = whole();
    fs::write(folder.join("video.mkv"), b"ten").unwrap();
    let recording = Recording::open(&folder).unwrap();
    assert_eq!(losses(&recording).len(), 1);
    for named in ["video.mkv", "3 bytes", "10"] {
        assert!(losses(&recording)[0].contains(named), "{named}");
    }
}

#[test]
fn a_missing_video_is_an_error() {
    let (_root, folder) = whole();
    fs::remove_file(folder.join("video.mkv")).unwrap();
    refused(Recording::open(&folder), "video.mkv");
}

#[test]
fn damage_to_the_index_is_reported_by_line_or_as_a_loss() {
    let (_root, folder) = whole();
    let path = folder.join("frames.jsonl");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\"n\":4", "\"n\":5")).unwrap();
    let message = Recording::open(&folder).unwrap_err().to_string();
    assert!(
        message.contains("line 5 ") && message.contains("n = 5"),
        "{message}"
    );
    fs::write(&path, &text[..text.len() - 10]).unwrap();
    assert_eq!(losses(&Recording::open(&folder).unwrap()).len(), 2);
    fs::remove_file(&path).unwrap();
    assert!(Recording::open(&folder).unwrap().frames.is_none());
}

#[test]
fn dropped_frames_and_faults_are_reported() {
    let (_root, folder) = whole();
    let path = folder.join("frames.jsonl");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace("\"sequence\":9", "\"sequence\":11")).unwrap();
    edit(
        &folder,
        "\"faults\": []",
        r#""faults": [{"t_us": 5, "what": "the table was slow"}]"#,
    );
    let recording = Recording::open(&folder).unwrap();
    let texts: Vec<_> = recording.notices.iter().map(Notice::text).collect();
    assert_eq!(texts.len(), 2);
    assert!(texts[0].contains("the table was slow"), "{texts:?}");
    assert!(
        texts[1].contains("2 frames") && texts[1].contains("frame 9"),
        "{texts:?}"
    );
}

#[test]
fn inputs_are_sessions_folders_of_them_or_videos() {
    let (root, folder) = whole();
    let bare = root.path().join("clip one.mp4");
    fs::write(&bare, b"").unwrap();
    assert_eq!(recordings(&folder).unwrap(), std::slice::from_ref(&folder));
    assert_eq!(recordings(&bare).unwrap(), std::slice::from_ref(&bare));
    assert_eq!(Recording::open(&bare).unwrap().id, "clip_one");
    fs::remove_file(&bare).unwrap();
    assert_eq!(recordings(root.path()).unwrap(), [folder]);
    refused(recordings(&bare), "clip one.mp4");
    let empty = tempfile::tempdir().unwrap();
    refused(recordings(empty.path()), &empty.path().to_string_lossy());
}

#[test]
fn a_video_beside_sessions_does_not_hide_them() {
    let (root, folder) = whole();
    let video = root.path().join("preview.mkv");
    fs::write(&video, b"").unwrap();
    assert_eq!(recordings(root.path()).unwrap(), [folder, video]);
}

#[test]
fn a_folder_of_clips_is_one_recording_each_and_with_a_single_video_it_may_be_either() {
    let root = tempfile::tempdir().unwrap();
    let at = |name: &str| root.path().join(name);
    fs::write(at("a.mp4"), b"").unwrap();
    assert_eq!(recordings(root.path()).unwrap(), [root.path()]);
    assert_eq!(clips(root.path()).unwrap(), [at("a.mp4")]);
    fs::write(at("b.MOV"), b"").unwrap();
    fs::write(at("notes.txt"), b"").unwrap();
    fs::create_dir(at("empty")).unwrap();
    assert_eq!(recordings(root.path()).unwrap(), [at("a.mp4"), at("b.MOV")]);
    assert_eq!(clips(root.path()).unwrap(), [at("a.mp4"), at("b.MOV")]);
    let beside = beside_recordings(root.path()).unwrap();
    assert_eq!(beside, [at("empty"), at("notes.txt")]);
}

#[test]
fn a_folder_that_stands_for_its_video_does_not_hide_folders_of_recordings() {
    let (root, _) = whole();
    let folder = root.path().join("clip");
    let inner = folder.join("monday");
    fs::create_dir_all(inner.join("turn")).unwrap();
    fs::create_dir(folder.join("notes")).unwrap();
    fs::write(folder.join("a.mp4"), b"").unwrap();
    assert_eq!(hidden_recordings(&folder), [] as [&Path; 0]);
    fs::write(inner.join("turn/b.mp4"), b"").unwrap();
    assert_eq!(recordings(&folder).unwrap(), std::slice::from_ref(&folder));
    assert_eq!(hidden_recordings(&folder), [inner]);
}

#[test]
fn a_link_to_a_video_that_leads_nowhere_is_a_recording_that_cannot_be_opened() {
    let root = tempfile::tempdir().unwrap();
    let [lost, whole] = ["lost.mp4", "whole.mp4"].map(|name| root.path().join(name));
    fs::write(&whole, b"").unwrap();
    std::os::unix::fs::symlink(root.path().join("nowhere"), &lost).unwrap();
    assert_eq!(recordings(root.path()).unwrap(), [lost.clone(), whole]);
    refused(Recording::open(&lost), "lost.mp4");
}

#[test]
fn a_session_that_lost_its_manifest_and_video_is_not_skipped() {
    let (root, folder) = whole();
    let lost = root.path().join("lost");
    fs::create_dir(&lost).unwrap();
    fs::write(lost.join("frames.jsonl"), b"").unwrap();
    assert_eq!(recordings(root.path()).unwrap(), [folder, lost.clone()]);
    refused(Recording::open(&lost), &lost.to_string_lossy());
}

#[test]
fn a_folder_with_one_video_and_no_manifest_is_read_with_a_warning() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("spot");
    fs::create_dir(&folder).unwrap();
    fs::write(folder.join("video.mkv"), b"").unwrap();
    let recording = Recording::open(&folder).unwrap();
    assert_eq!(recording.id, "spot");
    assert!(recording.notices[0].text().contains("session.json"));
}

#[test]
fn a_folder_with_two_videos_and_no_manifest_is_refused() {
    let root = tempfile::tempdir().unwrap();
    for video in ["video.mkv", "other.mp4"] {
        fs::write(root.path().join(video), b"").unwrap();
    }
    refused(Recording::open(root.path()), "2 ");
}

#[test]
fn the_object_is_what_follows_the_time() {
    assert_eq!(object_of("20261120T093015Z-blue-mug"), "blue-mug");
    assert_eq!(object_of("mug"), "mug");
    assert_eq!(object_of("jazZ-band"), "jazZ-band");
}

proptest! {
    #[test]
    fn no_bytes_make_the_readers_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        let _ = Manifest::from_json(&bytes);
        let _ = FrameIndex::parse(&bytes);
    }

    #[test]
    fn a_damaged_manifest_is_refused_or_reads_as_one_that_can_be_written(
        at in 0_usize..900, byte in any::<u8>(),
    ) {
        let mut complete = manifest();
        complete.status = Status::Aborted("why".to_owned());
        let mut bytes = complete.to_json().unwrap();
        let at = at % bytes.len();
        bytes[at] = byte;
        if let Ok(read) = Manifest::from_json(&bytes) {
            prop_assert_eq!(Manifest::from_json(&read.to_json().unwrap()).unwrap(), read);
        }
    }
}
