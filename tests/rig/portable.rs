//! Captures by the portable library, which uses V4L2 here and tells nothing of its counter and clock.

use relit_data::session::{FrameClock, Status};

use crate::camera::Vivid;
use crate::program::{Running, sessions};

/// A turn of ten seconds in 100 frames, without a table.
const TURN: [&str; 10] = [
    "--camera",
    "nokhwa:0",
    "--turntable",
    "none",
    "--mode",
    "YUYV:320x180@10",
    "--degrees-per-second",
    "36",
    "--max-dropped",
    "60",
];

#[test]
#[ignore = "needs the driver vivid"]
fn a_capture_without_v4l2_says_whose_clock_stamped_it_and_what_was_not_held() {
    drop(Vivid::open());
    let ended = Running::start(&sessions("portable"), &TURN).end();
    assert!(matches!(ended.code, Some(0 | 3)), "{ended:#?}");
    let session = ended.session();
    let manifest = session.manifest.as_ref().unwrap();
    assert_eq!(manifest.status, Status::Complete);
    let camera = &manifest.camera;
    assert_eq!(
        (camera.backend.as_str(), camera.device.as_str()),
        ("nokhwa", "0")
    );
    assert_eq!(
        (camera.name.as_str(), camera.clock),
        ("vivid", FrameClock::Host)
    );
    let mut faults = manifest.faults.iter();
    assert!(
        faults.any(|fault| fault.what.contains("exposure")),
        "{:#?}",
        manifest.faults
    );
    assert!(ended.noted("camera settings").contains("exposure"));
    let entries = session.frames.as_ref().unwrap().entries();
    assert_eq!(manifest.video.frames, Some(entries.len() as u64));
    let took = entries[entries.len() - 1].t_us - entries[0].t_us;
    assert!((9_000_000..11_000_000).contains(&took), "{took} us");
    println!(
        "{} frames in {took} us by the host's clock; {} controls held; exit {:?}",
        entries.len(),
        camera.controls.len(),
        ended.code
    );
}

#[test]
#[ignore = "needs the driver vivid"]
fn frames_that_a_camera_without_a_counter_drops_show_in_the_time_stamps() {
    let mut vivid = Vivid::open();
    vivid.set("percentage_of_dropped_buffers", 20);
    let ended = Running::start(&sessions("portable-drops"), &TURN).end();
    vivid.set("percentage_of_dropped_buffers", 0);
    let manifest = ended.manifest();
    let missing: Vec<&str> = manifest
        .faults
        .iter()
        .map(|fault| fault.what.as_str())
        .filter(|what| what.contains(" frame "))
        .collect();
    assert!(missing.len() > 3, "{:#?}", manifest.faults);
    println!("{} gaps, e.g. {}", missing.len(), missing[0]);
}
