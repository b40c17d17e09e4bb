//! Turns that come out well.

use std::path::Path;

use image::{GrayImage, Luma};
use relit_data::session::{FrameEntry, Status};

use crate::camera::{BufferTrace, DeliveredBuffer, VIVID, Vivid};
use crate::program::{Running, extract, sessions};
use crate::turntable;

/// Frames that may be missing. An emulated driver is late now and then and leaves one out: that is
/// told, and is no fault of the recorder's.
pub(crate) const TOLERANT: [&str; 2] = ["--max-dropped", "60"];

/// A turn of ten seconds in this mode, with 10 frames a second as much as emulation carries.
pub(crate) fn turn<'a>(mode: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut arguments = vec!["--camera", VIVID, "--turntable", "serial:/dev/ttyS1"];
    arguments.extend(["--mode", mode]);
    arguments.extend(["--degrees-per-second", "36"]);
    arguments.extend(more);
    arguments
}

#[test]
#[ignore = "needs the driver vivid and a serial line"]
fn every_frame_that_the_kernel_handed_out_during_the_turn_is_in_the_session() {
    drop(Vivid::open());
    let root = sessions("turn");
    let trace = BufferTrace::begin();
    let ended = Running::start(&root, &turn("YUYV:640x480@10", &TOLERANT)).end();
    let handed = trace.end();
    let state = turntable::stands();
    assert!(matches!(ended.code, Some(0 | 3)), "{ended:#?}");
    let session = ended.session();
    let manifest = session.manifest.clone().unwrap();
    assert_eq!(manifest.status, Status::Complete);
    let entries = session.frames.as_ref().unwrap().entries();
    assert_eq!(manifest.video.frames, Some(entries.len() as u64));
    let of_turn = between(&handed, entries);
    assert_eq!(entries.len(), of_turn.len());
    check_counted(entries, &of_turn);
    let turned = check_angles(entries);
    let samples = check_extracted(&session.folder.unwrap());
    let counted = entries[entries.len() - 1].sequence - entries[0].sequence + 1;
    println!(
        "{} frames, all that the kernel handed out; it counted {counted}; {turned:.1} degrees; \
         {samples}; table {state}",
        entries.len()
    );
}

/// What the kernel handed out from the first recorded frame to the last.
fn between(handed: &[DeliveredBuffer], entries: &[FrameEntry]) -> Vec<DeliveredBuffer> {
    let time = entries[0].t_us..=entries[entries.len() - 1].t_us;
    let of_turn = handed.iter().filter(|frame| time.contains(&frame.t_us));
    of_turn.copied().collect()
}

/// Each frame's stamp and number are the kernel's. A number that the driver gave twice is raised,
/// as numbers in a session grow.
fn check_counted(entries: &[FrameEntry], handed: &[DeliveredBuffer]) {
    let mut least = 0;
    for (entry, frame) in entries.iter().zip(handed) {
        let number = frame.sequence.max(least);
        assert_eq!((entry.sequence, entry.t_us), (number, frame.t_us));
        least = number + 1;
    }
}

/// Angles grow with the time by the speed asked for; gives how far they reach.
fn check_angles(entries: &[FrameEntry]) -> f64 {
    let first = entries[0];
    for entry in entries {
        let due = 36.0 * (entry.t_us - first.t_us) as f64 / 1e6;
        let turned = entry.angle_deg.unwrap() - first.angle_deg.unwrap();
        assert!((turned.abs() - due).abs() < 0.5, "{entry:?}");
    }
    let last = entries[entries.len() - 1];
    let turned = (last.angle_deg.unwrap() - first.angle_deg.unwrap()).abs();
    assert!((330.0..=362.0).contains(&turned), "{turned}");
    turned
}

/// `relit-extract` reads the session, with the picture's middle as the object.
fn check_extracted(session: &Path) -> String {
    let mask = session.with_file_name("mask.png");
    let is_object = |x: u32, y: u32| (220..420).contains(&x) && (140..340).contains(&y);
    let paint = |x, y| Luma([if is_object(x, y) { 255_u8 } else { 0 }]);
    GrayImage::from_fn(640, 480, paint).save(&mask).unwrap();
    let out = session.with_file_name("samples");
    let arguments = [
        "-o",
        out.to_str().unwrap(),
        "--mask",
        mask.to_str().unwrap(),
    ];
    let (code, told) = extract(session, &arguments);
    assert!(matches!(code, Some(0 | 3)), "{told}");
    format!("relit-extract ends with {}", code.unwrap())
}
