//! Turns in which the camera fails.

use std::io;
use std::time::Instant;

use relit_camera::{CameraError, FrameFault};
use relit_data::session::Status;

use crate::camera::{Unplugged, Vivid};
use crate::program::{Ended, Running, sessions};
use crate::turn::{TOLERANT, turn};
use crate::turntable;

/// The camera that vivid is.
const DEVICE: &str = "/dev/video0";

fn unplugged() -> CameraError {
    CameraError::Unplugged {
        device: DEVICE.to_owned(),
        source: None,
    }
}

/// A picture that costs an emulated machine little.
const SMALL: &str = "YUYV:320x180@10";
/// Seconds that the end of a take may take in an emulated machine: noticing, stopping the table,
/// and closing the session.
const ENDS_WITHIN: f64 = 30.0;

/// Starts a turn, lets `fault` happen in it, and checks that the session is kept as aborted, the
/// reason told, and the table stopped.
fn check_ends(test: &str, why: &CameraError, fault: impl FnOnce()) {
    let mut running = Running::start(&sessions(test), &turn(SMALL, &[]));
    running.until_recording();
    let start = Instant::now();
    fault();
    let ended = running.end();
    let took = start.elapsed().as_secs_f64();
    let noticed = ended
        .time_of("checking")
        .duration_since(start)
        .as_secs_f64();
    let state = turntable::stands();
    assert_eq!(ended.code, Some(1), "{ended:#?}");
    let why = why.to_string();
    assert!(ended.reason().contains(&why), "{:?}", ended.reason());
    assert!(took < ENDS_WITHIN, "{took}");
    let kept = kept(&ended);
    println!(
        "stopped after {noticed:.1} s, exit 1 after {took:.1} s, {kept}, table {state}: {}",
        ended.reason()
    );
}

/// What is kept of an aborted take.
fn kept(ended: &Ended) -> String {
    let session = ended.session();
    let manifest = session.manifest.as_ref().unwrap();
    let Status::Aborted(reason) = &manifest.status else {
        panic!("{:?}", manifest.status);
    };
    assert_eq!(reason, ended.reason());
    let frames = session.frames.as_ref().unwrap().entries().len();
    assert!(frames > 0, "{:?}", session.notices);
    assert_eq!(manifest.video.frames, Some(frames as u64));
    format!("aborted with {frames} frames")
}

#[test]
#[ignore = "needs the driver vivid and a serial line"]
fn a_disconnected_camera_ends_the_take_and_stops_the_table() {
    let mut vivid = Vivid::open();
    check_ends("disconnect", &unplugged(), move || {
        // The answer may be that the device is gone.
        let _ = vivid.press("disconnect", 1);
    });
}

#[test]
#[ignore = "needs the driver vivid and a serial line"]
fn an_unplugged_camera_ends_the_take_and_is_recorded_again_when_it_is_back() {
    drop(Vivid::open());
    let mut gone = None;
    check_ends("unplug", &unplugged(), || gone = Some(Unplugged::now()));
    let root = sessions("unplugged");
    let refused = Running::start(&root, &turn(SMALL, &[])).end();
    let reason = refused.refusal().to_owned();
    assert!(reason.contains(DEVICE), "{reason}");
    drop(gone);
    let again = Running::start(&root, &turn(SMALL, &TOLERANT)).end();
    assert_eq!(again.manifest().status, Status::Complete, "{again:#?}");
    println!(
        "while it is away: {reason}; when it is back: exit {:?}, complete, table {}",
        again.code,
        turntable::stands()
    );
}

#[test]
#[ignore = "needs the driver vivid and a serial line"]
fn a_broken_stream_ends_the_take_and_stops_the_table() {
    let mut vivid = Vivid::open();
    let broken = CameraError::Stream {
        device: DEVICE.to_owned(),
        doing: "read",
        source: io::ErrorKind::Other.into(),
    };
    check_ends("stream", &broken, move || {
        vivid.press("inject_fatal_streaming_error", 1).unwrap();
    });
}

#[test]
#[ignore = "needs the driver vivid and a serial line"]
fn dropped_frames_spoil_the_take_and_are_counted() {
    let mut vivid = Vivid::open();
    vivid.set("percentage_of_dropped_buffers", 30);
    let ended = Running::start(&sessions("dropped"), &turn(SMALL, &[])).end();
    vivid.set("percentage_of_dropped_buffers", 0);
    assert_eq!(ended.code, Some(1), "{ended:#?}");
    let session = ended.session();
    assert!(!session.frames.as_ref().unwrap().gaps().is_empty());
    let manifest = ended.manifest();
    assert!(matches!(manifest.status, Status::Aborted(_)));
    println!(
        "exit 1, aborted with {} faults told, table {}: {}",
        manifest.faults.len(),
        turntable::stands(),
        ended.reason()
    );
}

#[test]
#[ignore = "needs the driver vivid and a serial line"]
fn a_damaged_frame_is_told_and_counts_against_the_take() {
    let mut vivid = Vivid::open();
    let root = sessions("damaged");
    let mut running = Running::start(&root, &turn(SMALL, &TOLERANT));
    running.until_recording();
    vivid.press("inject_v4l2_buf_flag_error", 1).unwrap();
    let ended = running.end();
    assert_eq!(ended.code, Some(3), "{ended:#?}");
    let manifest = ended.manifest();
    assert_eq!(manifest.status, Status::Complete);
    let damaged: Vec<&str> = manifest
        .faults
        .iter()
        .map(|fault| fault.what.as_str())
        .filter(|what| what.contains(&FrameFault::Flagged.to_string()))
        .collect();
    assert_eq!(damaged.len(), 1, "{:#?}", manifest.faults);
    println!(
        "exit 3, complete, table {}: {}",
        turntable::stands(),
        damaged[0]
    );
}

#[test]
#[ignore = "needs the driver vivid and a serial line"]
fn a_camera_that_does_not_start_is_told_before_the_table_turns() {
    let mut vivid = Vivid::open();
    let before = turntable::stands();
    vivid.press("inject_vidioc_streamon_error", 1).unwrap();
    let ended = Running::start(&sessions("start"), &turn(SMALL, &[])).end();
    println!("exit 1, no session, table {before}: {}", ended.refusal());
}

#[test]
#[ignore = "needs the driver vivid and a serial line"]
fn a_second_recorder_is_refused_and_the_first_goes_on() {
    drop(Vivid::open());
    let root = sessions("first");
    let mut first = Running::start(&root, &turn(SMALL, &TOLERANT));
    first.until_recording();
    let second = Running::start(&sessions("second"), &turn(SMALL, &[])).end();
    assert!(second.refusal().contains(DEVICE), "{second:#?}");
    let first = first.end();
    assert_eq!(first.manifest().status, Status::Complete, "{first:#?}");
    println!(
        "first: exit {:?}, complete, table {}; second: {}",
        first.code,
        turntable::stands(),
        second.reason()
    );
}
