//! Replays of the recorded sessions, with and without faults.

use std::path::{Path, PathBuf};

use super::*;
use crate::{Fourcc, FrameFault, Rate, open};
use relit_data::session::FrameIndex;

const SHORT: &str = "20261120T101500Z-cow-short";
const DROPPED: &str = "20261120T103000Z-cow-dropped";
const CUT: &str = "20261120T104500Z-cow-cut";
const WHOLE: &str = "20261120T093015Z-cow";
const TIMEOUT: Duration = Duration::from_secs(20);

fn fixture(name: &str) -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    root.join("../../fixtures").join(name)
}

fn request() -> CameraMode {
    CameraMode {
        fourcc: Fourcc::MJPG,
        width: 480,
        height: 360,
        rate: Rate::new(30, 1).unwrap(),
    }
}

fn started(name: &str, options: &str) -> Box<dyn Camera> {
    let address = format!("replay:{}?{options}", fixture(name).display());
    let mut camera = open(&address.parse().unwrap(), Clock::virtual_time()).unwrap();
    camera.start(&request()).unwrap();
    camera
}

/// All frames, and how it ended.
fn play(camera: &mut dyn Camera) -> (Vec<Frame>, CameraError) {
    let mut frames = Vec::new();
    loop {
        match camera.next_frame(TIMEOUT) {
            Ok(frame) => frames.push(frame),
            Err(end) => return (frames, end),
        }
    }
}

fn recorded(name: &str) -> FrameIndex {
    FrameIndex::parse(&std::fs::read(fixture(name).join("frames.jsonl")).unwrap()).unwrap()
}

fn sequences(frames: &[Frame]) -> Vec<u64> {
    let sequences = frames.iter().map(|frame| frame.sequence.unwrap());
    sequences.collect()
}

#[test]
fn frames_are_the_recorded_bytes_with_the_recorded_counter_and_times() {
    for name in [SHORT, DROPPED] {
        let (frames, end) = play(&mut *started(name, ""));
        let entries = recorded(name).entries().to_vec();
        let count = entries.len() as u64;
        let ended = matches!(end, CameraError::EndOfRecording { frames, .. } if frames == count);
        assert!(ended, "{end}");
        let wanted: Vec<u64> = entries.iter().map(|entry| entry.sequence).collect();
        assert_eq!(sequences(&frames), wanted);
        let since = |times: Vec<i64>| -> Vec<i64> { times.iter().map(|t| t - times[0]).collect() };
        assert_eq!(
            since(frames.iter().map(|frame| frame.t_us).collect()),
            since(entries.iter().map(|entry| entry.t_us).collect())
        );
        let file = std::fs::read(fixture(name).join("video.mkv")).unwrap();
        let mut rest = file.as_slice();
        for frame in &frames {
            assert_eq!(frame.fault(), None);
            let found = rest
                .windows(frame.data.len())
                .position(|part| part == frame.data);
            rest = &rest[found.unwrap() + frame.data.len()..];
        }
    }
}

#[test]
fn a_replay_says_what_it_is() {
    let camera = started(DROPPED, "");
    let info = camera.info();
    assert_eq!(
        (info.name.as_str(), info.driver.as_str()),
        ("rendered camera", "replay")
    );
    assert_eq!(info.modes[0].to_string(), "MJPG 480x360, 30 frames/s");
    assert_eq!(info.problems.len(), 3, "{:?}", info.problems);
    let gap = &info.problems[0];
    assert!(
        gap.contains("2 frames") && gap.contains("frame 40"),
        "{gap}"
    );
}

#[test]
fn a_cut_session_ends_after_its_last_whole_frame_and_says_so() {
    let mut camera = started(CUT, "");
    // That the capture was aborted, and that the video is truncated.
    let problems = &camera.info().problems;
    assert!(problems.len() >= 2, "{problems:?}");
    assert!(
        problems.iter().any(|problem| problem.contains("byte")),
        "{problems:?}"
    );
    let (frames, end) = play(&mut *camera);
    assert_eq!(frames.len(), 85);
    assert!(frames.iter().all(|frame| frame.fault().is_none()));
    assert!(matches!(end, CameraError::EndOfRecording { .. }), "{end}");
}

#[test]
fn h264_out_of_order_is_decoded_to_the_same_samples() {
    let mut camera = started(WHOLE, "");
    assert_eq!(camera.info().modes[0].fourcc, Fourcc::NV12);
    let frames: Vec<Frame> = (0..60)
        .map(|_| camera.next_frame(TIMEOUT).unwrap())
        .collect();
    assert!(frames.iter().all(|frame| frame.fault().is_none()));
    assert!(sequences(&frames).into_iter().eq(0..60));
    let video = Video::open(&fixture(WHOLE).join("video.mkv")).unwrap();
    let last = video.frame(59).unwrap();
    let (width, height) = last.dimensions();
    let luma = f64::from(frames[59].data[(height / 2 * width + width / 2) as usize]);
    let [r, g, b] = last.get_pixel(width / 2, height / 2).0.map(f64::from);
    let wanted = 16.0 + (0.299 * r + 0.587 * g + 0.114 * b) * 219.0 / 255.0;
    assert!((luma - wanted).abs() < 4.0, "{luma} {wanted}");
    // Ends the decoding thread in the middle.
    camera.stop().unwrap();
    let error = camera.next_frame(TIMEOUT).unwrap_err();
    assert!(matches!(error, CameraError::NotStarted { .. }), "{error}");
}

#[test]
fn dropped_frames_are_gaps_in_the_counter_alone() {
    let (frames, _) = play(&mut *started(SHORT, "drop=0,7,8"));
    let wanted: Vec<u64> = (0..150).filter(|n| ![0, 7, 8].contains(n)).collect();
    assert_eq!(sequences(&frames), wanted);
}

#[test]
fn damaged_flagged_and_resized_frames_are_found_at_their_place() {
    let (frames, _) = play(&mut *started(SHORT, "damage=5&flag=6&resize=148"));
    let faults: Vec<(usize, FrameFault)> = frames
        .iter()
        .enumerate()
        .filter_map(|(at, frame)| Some((at, frame.fault()?)))
        .collect();
    let other = FrameFault::OtherSize {
        width: 240,
        height: 180,
    };
    assert_eq!(
        faults,
        [
            (5, FrameFault::NoEnd),
            (6, FrameFault::Flagged),
            (148, other),
            (149, other)
        ]
    );
}

#[test]
fn an_unplugged_camera_stays_away_until_it_is_started_again() {
    let mut camera = started(SHORT, "unplug=3");
    for _ in 0..2 {
        let (frames, end) = play(&mut *camera);
        assert_eq!(sequences(&frames), [0, 1, 2]);
        assert!(matches!(end, CameraError::Unplugged { .. }), "{end}");
        let again = camera.next_frame(TIMEOUT).unwrap_err();
        assert!(matches!(again, CameraError::Unplugged { .. }), "{again}");
        camera.start(&request()).unwrap();
    }
}

#[test]
fn a_stalled_camera_times_out_again_and_again() {
    let clock = Clock::virtual_time();
    let address = format!("replay:{}?stall=1", fixture(SHORT).display());
    let mut camera = open(&address.parse().unwrap(), clock.clone()).unwrap();
    camera.start(&request()).unwrap();
    assert!(camera.next_frame(TIMEOUT).is_ok());
    for _ in 0..2 {
        let start_us = clock.now_us();
        let error = camera.next_frame(TIMEOUT).unwrap_err();
        assert!(matches!(error, CameraError::Timeout { .. }), "{error}");
        assert_eq!(clock.now_us() - start_us, 20_000_000);
    }
}

#[test]
fn a_loop_counts_on_and_its_faults_too() {
    let mut camera = started(DROPPED, "loop=1&drop=147");
    let frames: Vec<Frame> = (0..200)
        .map(|_| camera.next_frame(TIMEOUT).unwrap())
        .collect();
    let counted = sequences(&frames);
    // 146 frames counted 0 to 149; the second one of the second round is dropped.
    assert_eq!(counted[145..148], [149, 150, 152]);
    assert!(frames.windows(2).all(|pair| pair[0].t_us < pair[1].t_us));
    assert_eq!(frames[146].data, frames[0].data);
}

#[test]
fn frames_come_when_the_clock_shows_their_time_stamp() {
    let entries = recorded(SHORT).entries().to_vec();
    let recorded_us = entries[149].t_us - entries[0].t_us;
    let clock = Clock::virtual_time();
    let _participant = clock.participate();
    let address = format!("replay:{}", fixture(SHORT).display());
    let mut camera = open(&address.parse().unwrap(), clock.clone()).unwrap();
    camera.start(&request()).unwrap();
    let first = camera.next_frame(TIMEOUT).unwrap();
    let mut last_us = first.t_us;
    for _ in 1..150 {
        last_us = camera.next_frame(TIMEOUT).unwrap().t_us;
        assert_eq!(clock.now_us(), last_us);
    }
    assert_eq!(last_us - first.t_us, recorded_us);
}

#[test]
fn a_frame_that_is_not_due_yet_is_not_lost_by_a_timeout() {
    let mut camera = started(SHORT, "");
    let first = camera.next_frame(TIMEOUT).unwrap();
    let mut timeouts = 0;
    let second = loop {
        match camera.next_frame(Duration::from_millis(1)) {
            Ok(frame) => break frame,
            Err(CameraError::Timeout { .. }) => timeouts += 1,
            Err(other) => panic!("{other}"),
        }
    };
    assert!(timeouts > 0);
    assert_eq!(sequences(&[first, second]), [0, 1]);
}

#[test]
fn recorded_controls_are_shown_and_cannot_be_set() {
    let mut camera = started(SHORT, "");
    let controls = camera.controls().unwrap();
    let names: Vec<&str> = controls
        .iter()
        .map(|control| control.name.as_str())
        .collect();
    let recorded = [
        "auto_exposure",
        "exposure_time_absolute",
        "gain",
        "white_balance_automatic",
    ];
    assert_eq!(names, recorded);
    assert_eq!(controls[1].value, Some(156));
    assert!(controls.iter().all(|control| control.flags.read_only));
    let error = camera.set_control(controls[1].id, 5).unwrap_err();
    assert!(matches!(error, CameraError::Unsupported { .. }), "{error}");
}

#[test]
fn what_cannot_be_replayed_is_refused_with_a_sentence() {
    let open = |address: String| match open(&address.parse().unwrap(), Clock::monotonic()) {
        Ok(_) => panic!("{address} was opened"),
        Err(error) => error.to_string(),
    };
    assert!(open("replay:/there/is/none".to_owned()).contains("/there/is/none"));
    let readme = fixture("README.md");
    assert!(open(format!("replay:{}", readme.display())).contains("README.md"));
}
