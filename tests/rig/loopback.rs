//! A fixture played into the kernel, and recorded back.

use std::collections::HashMap;
use std::path::Path;

use relit_data::session::Status;
use relit_video::Video;

use crate::program::{Running, sessions};

/// What the machine plays into `/dev/video10`, over and over.
const PLAYED: &str = "../fixtures/20261120T101500Z-cow-short/video.mkv";

/// The coded frames of a video.
fn coded(video: &Path) -> Vec<Vec<u8>> {
    let video = Video::open(video).unwrap();
    video.packets().unwrap().map(|frame| frame.data).collect()
}

#[test]
#[ignore = "needs the driver v4l2loopback"]
fn the_frames_that_a_camera_delivers_are_recorded_byte_for_byte_and_in_order() {
    let played = coded(&Path::new(env!("CARGO_MANIFEST_DIR")).join(PLAYED));
    let place: HashMap<&[u8], usize> = played.iter().map(Vec::as_slice).zip(0..).collect();
    assert_eq!(place.len(), played.len());
    let arguments = [
        "--camera",
        "v4l2:/dev/video10",
        "--turntable",
        "none",
        "--mode",
        "MJPG@30",
        "--degrees-per-second",
        "36",
        "--max-dropped",
        "100",
    ];
    let ended = Running::start(&sessions("loopback"), &arguments).end();
    assert!(matches!(ended.code, Some(0 | 3)), "{ended:#?}");
    let session = ended.session();
    assert_eq!(session.manifest.as_ref().unwrap().status, Status::Complete);
    let entries = session.frames.as_ref().unwrap().entries();
    let recorded = coded(&session.video);
    assert_eq!(recorded.len(), entries.len());
    assert!(recorded.len() > 150, "{} frames", recorded.len());
    let first = place[recorded[0].as_slice()];
    for (frame, entry) in recorded.iter().zip(entries) {
        // The driver counts what was played.
        let later = usize::try_from(entry.sequence - entries[0].sequence).unwrap();
        let due = (first + later) % played.len();
        assert_eq!(place.get(frame.as_slice()), Some(&due), "{entry:?}");
    }
    let counted = entries[entries.len() - 1].sequence - entries[0].sequence + 1;
    println!(
        "{} of {counted} frames played, each byte for byte and in its place; exit {:?}",
        recorded.len(),
        ended.code
    );
}
