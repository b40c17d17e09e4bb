//! Bare videos as cameras, on files that the `ffmpeg` program makes.
#![allow(missing_docs, clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::time::Duration;

use relit_camera::{self as camera, Camera, CameraError, CameraMode, Fourcc, Frame, Rate};
use relit_data::clock::Clock;
use relit_test_support::ffmpeg;
use tempfile::TempDir;

const PATTERN: &str = "testsrc2=size=70x50:rate=25:duration=0.4";

/// A clip of ten frames, and the camera that it is replayed as.
fn replay(
    name: &str,
    encoding: &str,
    options: &str,
) -> (TempDir, Result<Box<dyn Camera>, CameraError>) {
    let folder = tempfile::tempdir().unwrap();
    let mut arguments = vec!["-f", "lavfi", "-i", PATTERN];
    arguments.extend(encoding.split_whitespace());
    arguments.push(name);
    ffmpeg(folder.path(), &arguments);
    let path = folder.path().join(name);
    let address = format!("replay:{}?{options}", path.display());
    let camera = camera::open(&address.parse().unwrap(), Clock::virtual_time());
    (folder, camera)
}

fn play(camera: &mut dyn Camera) -> Vec<Frame> {
    let mode = CameraMode {
        fourcc: Fourcc::MJPG,
        width: 640,
        height: 480,
        rate: Rate::new(30, 1).unwrap(),
    };
    camera.start(&mode).unwrap();
    let next = || camera.next_frame(Duration::from_secs(20)).ok();
    std::iter::from_fn(next).collect()
}

#[test]
fn every_codec_comes_in_the_format_that_a_camera_would_send() {
    for (name, encoding, mode) in [
        ("a.avi", "-c:v mjpeg", "MJPG 70x50, 25 frames/s"),
        ("a.mp4", "-c:v libx264 -bf 0", "H264 70x50, 25 frames/s"),
        (
            "b.mp4",
            "-c:v libx264 -bf 2 -pix_fmt yuv420p",
            "NV12 70x50, 25 frames/s",
        ),
        (
            "a.nut",
            "-c:v rawvideo -pix_fmt yuyv422",
            "YUYV 70x50, 25 frames/s",
        ),
        (
            "b.nut",
            "-c:v rawvideo -pix_fmt nv12",
            "NV12 70x50, 25 frames/s",
        ),
        (
            "c.nut",
            "-c:v rawvideo -pix_fmt rgb24",
            "RGB3 70x50, 25 frames/s",
        ),
        (
            "a.mkv",
            "-c:v ffv1 -pix_fmt yuv422p",
            "YUYV 70x50, 25 frames/s",
        ),
        (
            "b.mkv",
            "-c:v ffv1 -pix_fmt gray",
            "GREY 70x50, 25 frames/s",
        ),
        (
            "c.mkv",
            "-c:v ffv1 -pix_fmt yuv444p",
            "RGB3 70x50, 25 frames/s",
        ),
    ] {
        let (_folder, camera) = replay(name, encoding, "");
        let mut camera = camera.unwrap();
        assert_eq!(camera.info().modes[0].to_string(), mode, "{encoding}");
        let frames = play(&mut *camera);
        assert_eq!(frames.len(), 10, "{encoding}");
        for (frame, n) in frames.iter().zip(0..) {
            assert_eq!(frame.fault(), None, "{encoding}");
            assert_eq!(frame.sequence, Some(n));
            assert_eq!(frame.t_us - frames[0].t_us, n as i64 * 40_000, "{encoding}");
        }
    }
}

#[test]
fn a_raw_frame_of_another_size_is_told() {
    let encoding = "-c:v rawvideo -pix_fmt yuyv422";
    let (_folder, camera) = replay("a.nut", encoding, "resize=4");
    let frames = play(&mut *camera.unwrap());
    let faults: Vec<usize> = (0..10).filter(|&n| frames[n].fault().is_some()).collect();
    assert_eq!(faults, [4, 5, 6, 7, 8, 9]);
}

#[test]
fn h264_cannot_change_its_size_and_says_so() {
    let (_folder, camera) = replay("a.mp4", "-c:v libx264 -bf 0", "resize=4");
    let refused = camera.err().unwrap().to_string();
    assert!(refused.contains("resize"), "{refused}");
}
