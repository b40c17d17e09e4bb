//! The V4L2 cameras against the kernel's own test drivers, faults included.
//!
//! These tests need root and the driver `vivid` as `/dev/video0`; those on Motion JPEG need
//! `v4l2loopback` as `/dev/video10`, fed with Motion JPEG. They change the driver's controls and take
//! it away, so that they run one by one and only when asked. `make test-rig` runs them in a virtual
//! machine of its own; by hand:
//!
//! ```text
//! modprobe vivid n_devs=1 node_types=0x1 num_inputs=1 input_types=0 vid_cap_nr=0
//! cargo test --test v4l2 -- --ignored --test-threads=1
//! ```
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]
#![cfg(target_os = "linux")]

use std::collections::HashSet;
use std::fs;
use std::path::Path;
use std::time::{Duration, Instant};

use relit_camera::manual_controls::{ManualPlan, ManualValues};
use relit_camera::{
    self as camera, Camera, CameraError, CameraMode, ControlKind, Fourcc, Frame, Rate, Rates,
};
use relit_data::clock::Clock;
use relit_data::session::FrameClock;

const VIVID: &str = "v4l2:/dev/video0";
const LOOPBACK: &str = "v4l2:/dev/video10";
const DRIVER: &str = "/sys/bus/platform/drivers/vivid";
/// Long enough for an emulated machine.
const TIMEOUT: Duration = Duration::from_secs(20);

fn open(address: &str) -> Result<Box<dyn Camera>, CameraError> {
    camera::open(&address.parse().unwrap(), Clock::monotonic())
}

/// The driver with all its faults off.
fn vivid() -> Box<dyn Camera> {
    let mut camera = open(VIVID).unwrap();
    for name in [
        "percentage_of_dropped_buffers",
        "wrap_sequence_number",
        "timestamp_source",
    ] {
        set(&mut *camera, name, 0);
    }
    camera
}

fn id(camera: &mut dyn Camera, name: &str) -> u32 {
    let controls = camera.controls().unwrap();
    let control = controls.iter().find(|control| control.name == name);
    control.unwrap_or_else(|| panic!("no control {name}")).id
}

fn set(camera: &mut dyn Camera, name: &str, value: i64) {
    let id = id(camera, name);
    assert_eq!(camera.set_control(id, value).unwrap(), value, "{name}");
}

fn mode(fourcc: &[u8; 4], width: u32, height: u32, fps: u32) -> CameraMode {
    CameraMode {
        fourcc: Fourcc(*fourcc),
        width,
        height,
        rate: Rate::new(fps, 1).unwrap(),
    }
}

fn start(camera: &mut dyn Camera, mode: CameraMode) -> CameraMode {
    camera.start(&mode).unwrap()
}

fn frames(camera: &mut dyn Camera, count: usize) -> Vec<Frame> {
    (0..count)
        .map(|_| camera.next_frame(TIMEOUT).unwrap())
        .collect()
}

fn counted(frames: &[Frame]) -> Vec<u64> {
    frames.iter().map(|frame| frame.sequence.unwrap()).collect()
}

/// The highest rate, frames a second.
fn fastest(rates: &Rates) -> f64 {
    match rates {
        Rates::List(rates) => rates
            .iter()
            .map(|rate| rate.per_second())
            .fold(0.0, f64::max),
        Rates::Range { fastest, .. } => fastest.per_second(),
        Rates::Unknown => 0.0,
    }
}

/// Frames until the first error, and that with the time that it took to come.
fn until_error(camera: &mut dyn Camera) -> (usize, CameraError, Duration) {
    for count in 0.. {
        let asked = Instant::now();
        if let Err(error) = camera.next_frame(TIMEOUT) {
            return (count, error, asked.elapsed());
        }
        assert!(count < 500, "the fault never came");
    }
    unreachable!()
}

#[test]
#[ignore = "needs the driver vivid"]
fn the_driver_is_listed_with_its_modes() {
    let listed = camera::list();
    let vivid = listed
        .iter()
        .find(|info| info.address.to_string() == VIVID)
        .unwrap();
    println!("{} {} {}", vivid.name, vivid.driver, vivid.bus);
    for mode in vivid
        .modes
        .iter()
        .filter(|mode| mode.fourcc.to_string() == "YUYV")
    {
        println!("  {mode}");
    }
    assert_eq!(
        (vivid.name.as_str(), vivid.driver.as_str()),
        ("vivid", "vivid")
    );
    for wanted in ["YUYV", "NV12", "RGB3", "GREY", "RGGB"] {
        let found = |mode: &&camera::Mode| {
            mode.fourcc.to_string() == wanted && mode.sizes.contains(640, 480)
        };
        let mode = vivid.modes.iter().find(found).unwrap();
        assert!(fastest(&mode.rates) >= 25.0, "{mode}");
    }
    assert_eq!(vivid.problems, [] as [&str; 0]);
}

#[test]
#[ignore = "needs the driver vivid"]
fn fifty_frames_come_whole_counted_and_stamped() {
    let mut camera = vivid();
    let granted = start(&mut *camera, mode(b"YUYV", 640, 480, 25));
    assert_eq!(
        granted.differences(&mode(b"YUYV", 640, 480, 25)),
        [] as [&str; 0]
    );
    let before = Clock::monotonic().now_us();
    let frames = frames(&mut *camera, 50);
    let after = Clock::monotonic().now_us();
    let counted = counted(&frames);
    println!(
        "counted {} to {} in {} us",
        counted[0],
        counted[49],
        frames[49].t_us - frames[0].t_us
    );
    for frame in &frames {
        assert_eq!((frame.fault(), frame.data.len()), (None, 640 * 480 * 2));
        assert_eq!(frame.clock, FrameClock::Driver);
        // The driver stamps the end of a frame ahead of time.
        let around = before - 1_000_000..after + 1_000_000;
        assert!(around.contains(&frame.t_us), "{} in {around:?}", frame.t_us);
    }
    assert!(frames.is_sorted_by(|a, b| a.t_us < b.t_us));
    assert!(counted.is_sorted(), "{counted:?}");
    camera.stop().unwrap();
    camera.stop().unwrap();
    let error = camera.next_frame(TIMEOUT).unwrap_err();
    assert!(matches!(error, CameraError::NotStarted { .. }), "{error}");
}

#[test]
#[ignore = "needs the driver vivid"]
fn every_raw_format_comes_with_the_bytes_of_its_size() {
    let mut camera = vivid();
    for fourcc in [
        b"YUYV", b"NV12", b"RGB3", b"GREY", b"RGGB", b"BA81", b"GBRG", b"GRBG",
    ] {
        let granted = start(&mut *camera, mode(fourcc, 320, 180, 30));
        assert_eq!((granted.fourcc, granted.width), (Fourcc(*fourcc), 320));
        for frame in frames(&mut *camera, 3) {
            assert_eq!(frame.fault(), None, "{}", granted.fourcc);
        }
    }
}

#[test]
#[ignore = "needs the driver vivid"]
fn what_was_not_granted_is_told() {
    let mut camera = vivid();
    let asked = mode(b"MJPG", 1000, 700, 60);
    let granted = start(&mut *camera, asked);
    let differences = granted.differences(&asked);
    println!("{differences:?}");
    assert_eq!(differences.len(), 3);
    assert_eq!(frames(&mut *camera, 1)[0].fault(), None);
}

#[test]
#[ignore = "needs the driver vivid"]
fn controls_are_set_and_read_back() {
    let mut camera = vivid();
    let controls = camera.controls().unwrap();
    println!("{} controls", controls.len());
    for (name, values) in [
        ("brightness", [0, 200]),
        ("boolean", [0, 1]),
        ("integer_64_bits", [i64::MIN, 5_000_000_000]),
        ("menu", [1, 4]),
        ("integer_menu", [2, 8]),
        ("bitmask", [0, 0x0040_2010]),
    ] {
        for value in values {
            set(&mut *camera, name, value);
        }
    }
    let control = |name: &str| {
        controls
            .iter()
            .find(|control| control.name == name)
            .unwrap()
    };
    let ControlKind::Menu(items) = &control("menu").kind else {
        panic!("{:?}", control("menu"));
    };
    assert_eq!(items[0].label, "Menu Item 1");
    assert_eq!(control("button").value, None);
    assert!(control("read_only_integer_32_bits").flags.read_only);
    assert!(
        controls
            .iter()
            .all(|control| !control.name.contains("array"))
    );
    let clamped = camera
        .set_control(control("brightness").id, 70_000)
        .unwrap();
    assert_eq!(clamped, 255);
    let mut fault =
        |name: &str, value: i64| match camera.set_control(control(name).id, value).unwrap_err() {
            CameraError::Control { fault, .. } => fault,
            other => panic!("{other}"),
        };
    let locked = fault("read_only_integer_32_bits", 1);
    let hole = fault("menu", 9);
    let too_wide = fault("brightness", 1 << 40);
    assert!(too_wide.contains("255"), "{too_wide}");
    let unknown = camera.set_control(0x0098_09ff, 1).unwrap_err();
    let CameraError::Control { fault: unknown, .. } = unknown else {
        panic!("{unknown}");
    };
    let faults = HashSet::from([locked, hole, too_wide, unknown]);
    assert_eq!(faults.len(), 4, "{faults:?}");
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_camera_is_made_to_hold_still() {
    let mut camera = vivid();
    set(&mut *camera, "gain_automatic", 1);
    let wanted = ManualValues {
        gain: Some(33),
        ..ManualValues::default()
    };
    let plan = ManualPlan::new(&camera.controls().unwrap(), &wanted);
    assert_eq!(plan.apply(&mut *camera).unwrap(), []);
    let not_held = [
        "exposure (without a control)",
        "white balance (without a control)",
    ];
    assert_eq!(plan.not_held, not_held);
    set(&mut *camera, "gain", 34);
    let moved = plan.check(&camera.controls().unwrap());
    let moved = (&*moved[0].name, moved[0].should, moved[0].is);
    assert_eq!(moved, ("gain", 33, Some(34)));
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_frame_marked_as_damaged_is_delivered_and_told() {
    let mut camera = vivid();
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    frames(&mut *camera, 3);
    set(&mut *camera, "inject_v4l2_buf_flag_error", 1);
    let flagged = frames(&mut *camera, 15)
        .iter()
        .filter(|frame| frame.flagged)
        .count();
    assert_eq!(flagged, 1);
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_broken_stream_is_told_and_starts_again() {
    let mut camera = vivid();
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    frames(&mut *camera, 3);
    set(&mut *camera, "inject_fatal_streaming_error", 1);
    let (count, error, took) = until_error(&mut *camera);
    println!("after {count} frames and {took:?}: {error}");
    assert!(matches!(error, CameraError::Stream { .. }), "{error}");
    let again = camera.next_frame(TIMEOUT).unwrap_err();
    assert!(matches!(again, CameraError::Stream { .. }), "{again}");
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    frames(&mut *camera, 3);
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_disconnected_camera_is_told_at_once_and_comes_back() {
    let mut camera = vivid();
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    frames(&mut *camera, 3);
    set_and_forget(&mut *camera, "disconnect");
    let (count, error, took) = until_error(&mut *camera);
    println!("after {count} frames and {took:?}: {error}");
    assert!(matches!(error, CameraError::Unplugged { .. }), "{error}");
    assert!(took < Duration::from_secs(2), "{took:?}");
    let stopped = camera.stop();
    assert!(
        matches!(stopped, Err(CameraError::Unplugged { .. })),
        "{stopped:?}"
    );
    let controls = camera.controls();
    assert!(
        matches!(controls, Err(CameraError::Unplugged { .. })),
        "{controls:?}"
    );
    drop(camera);
    let mut camera = vivid();
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    frames(&mut *camera, 3);
}

/// Presses a button whose device may not answer any more.
fn set_and_forget(camera: &mut dyn Camera, name: &str) {
    let id = id(camera, name);
    let _ = camera.set_control(id, 1);
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_camera_whose_node_goes_is_unplugged_and_comes_back() {
    let mut camera = vivid();
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    frames(&mut *camera, 3);
    let unbind = std::thread::spawn(|| fs::write(format!("{DRIVER}/unbind"), "vivid.0").unwrap());
    let start_of_wait = Instant::now();
    let (count, error, took) = until_error(&mut *camera);
    println!(
        "after {count} frames, {took:?} of {:?}: {error}",
        start_of_wait.elapsed()
    );
    assert!(matches!(error, CameraError::Unplugged { .. }), "{error}");
    assert!(took < Duration::from_secs(2), "{took:?}");
    drop(camera);
    unbind.join().unwrap();
    let gone = open(VIVID).err().unwrap();
    assert!(matches!(gone, CameraError::NotThere { .. }), "{gone}");
    fs::write(format!("{DRIVER}/bind"), "vivid.0").unwrap();
    let mut camera = vivid();
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    frames(&mut *camera, 3);
}

#[test]
#[ignore = "needs the driver vivid"]
fn dropped_buffers_are_gaps_in_the_counter() {
    let mut camera = vivid();
    set(&mut *camera, "percentage_of_dropped_buffers", 50);
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    let counted = counted(&frames(&mut *camera, 40));
    set(&mut *camera, "percentage_of_dropped_buffers", 0);
    let missing = counted[39] - counted[0] - 39;
    println!("{missing} frames missing among 40");
    assert!((8..200).contains(&missing), "{counted:?}");
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_second_program_is_refused_and_the_first_goes_on() {
    let mut first = vivid();
    start(&mut *first, mode(b"YUYV", 320, 180, 30));
    first.claim().unwrap();
    let mut second = open(VIVID).unwrap();
    let refused = [
        second.claim(),
        second.start(&mode(b"YUYV", 640, 480, 25)).map(drop),
    ];
    for refused in refused.map(Result::unwrap_err) {
        println!("{refused}");
        assert!(matches!(refused, CameraError::InUse { .. }), "{refused}");
    }
    drop(second);
    for frame in frames(&mut *first, 10) {
        assert_eq!((frame.fault(), frame.width), (None, 320));
    }
}

#[test]
#[ignore = "needs the driver vivid"]
fn an_error_at_the_start_leaves_a_camera_that_starts() {
    let mut camera = vivid();
    for fault in [
        "inject_vidioc_reqbufs_error",
        "inject_vidioc_qbuf_error",
        "inject_vidioc_streamon_error",
    ] {
        set(&mut *camera, fault, 1);
        let error = camera.start(&mode(b"YUYV", 320, 180, 30)).unwrap_err();
        println!("{fault}: {error}");
        assert!(matches!(error, CameraError::Refused { .. }), "{error}");
        let error = camera.next_frame(TIMEOUT).unwrap_err();
        assert!(matches!(error, CameraError::NotStarted { .. }), "{error}");
        start(&mut *camera, mode(b"YUYV", 320, 180, 30));
        frames(&mut *camera, 3);
    }
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_buffer_that_is_not_taken_back_costs_no_frame() {
    let mut camera = vivid();
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    frames(&mut *camera, 3);
    for _ in 0..12 {
        set(&mut *camera, "inject_vidioc_qbuf_error", 1);
        assert_eq!(frames(&mut *camera, 2)[0].fault(), None);
    }
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_counter_that_wraps_goes_on() {
    let mut camera = vivid();
    set(&mut *camera, "wrap_sequence_number", 1);
    start(&mut *camera, mode(b"YUYV", 320, 180, 60));
    let frames = frames(&mut *camera, 150);
    set(&mut *camera, "wrap_sequence_number", 0);
    let counted = counted(&frames);
    println!("{} to {}", counted[0], counted[149]);
    assert!(
        counted[0] < 1 << 32 && counted[149] >= 1 << 32,
        "the counter does not wrap"
    );
    assert!(counted.is_sorted(), "{counted:?}");
}

#[test]
#[ignore = "needs the driver vivid"]
fn stamps_at_the_start_of_exposure_are_the_drivers_too() {
    let mut camera = vivid();
    set(&mut *camera, "timestamp_source", 1);
    start(&mut *camera, mode(b"YUYV", 320, 180, 30));
    let frame = frames(&mut *camera, 1).remove(0);
    set(&mut *camera, "timestamp_source", 0);
    assert_eq!(frame.clock, FrameClock::Driver);
}

#[test]
#[ignore = "needs the driver vivid"]
fn a_timeout_is_bounded_and_costs_no_frame() {
    let mut camera = vivid();
    start(&mut *camera, mode(b"YUYV", 1920, 1080, 5));
    let mut timeouts = 0;
    let mut counted = Vec::new();
    // On a busy machine frames come so late that one is often there at once.
    while counted.len() < 3 || timeouts == 0 {
        assert!(
            counted.len() < 500,
            "no wait of 1 ms ever ended without a frame"
        );
        let asked = Instant::now();
        match camera.next_frame(Duration::from_millis(1)) {
            Ok(frame) => counted.push(frame.sequence.unwrap()),
            Err(CameraError::Timeout { .. }) => timeouts += 1,
            Err(other) => panic!("{other}"),
        }
        assert!(asked.elapsed() < TIMEOUT);
    }
    println!("{timeouts} timeouts, counted {counted:?}");
    assert!(counted.is_sorted());
}

#[cfg(feature = "nokhwa")]
#[test]
#[ignore = "needs the driver vivid"]
fn the_portable_library_shows_the_same_camera() {
    let address = camera::CameraAddress::Nokhwa(0).to_string();
    let mut camera = open(&address).unwrap();
    println!(
        "{}: {} modes",
        camera.info().name,
        camera.info().modes.len()
    );
    let granted = start(&mut *camera, mode(b"YUYV", 640, 480, 25));
    println!("{granted}");
    for frame in frames(&mut *camera, 5) {
        assert_eq!((frame.sequence, frame.clock), (None, FrameClock::Host));
        assert_eq!(frame.fault(), None);
    }
    camera.stop().unwrap();
}

#[test]
#[ignore = "needs the driver v4l2loopback"]
fn motion_jpeg_comes_with_the_bytes_used_alone() {
    assert!(
        Path::new("/dev/video10").exists(),
        "needs v4l2loopback as /dev/video10"
    );
    let mut camera = open(LOOPBACK).unwrap();
    for mode in &camera.info().modes {
        println!("{mode}");
    }
    let offered = camera.info().modes[0].sizes.largest();
    let granted = start(&mut *camera, mode(b"MJPG", offered.0, offered.1, 30));
    println!("{granted}");
    let frames = frames(&mut *camera, 50);
    let sizes: Vec<usize> = frames.iter().map(|frame| frame.data.len()).collect();
    println!(
        "the first frame has {} bytes, the others {:?} to {:?}; stamps of {:?}",
        sizes[0],
        sizes[1..].iter().min(),
        sizes[1..].iter().max(),
        frames[1].clock
    );
    // The driver's first buffer may be one from before.
    for frame in &frames[1..] {
        assert_eq!(frame.fault(), None);
        assert!(
            frame.data.ends_with(&[0xff, 0xd9]),
            "{} bytes",
            frame.data.len()
        );
    }
    assert!(sizes[1..].iter().any(|&size| size != sizes[1]));
}
