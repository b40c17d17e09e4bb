//! The library's camera, played by a script.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::SyncSender;

use ::nokhwa::Buffer;
use ::nokhwa::camera_traits::CaptureBackendTrait;
use ::nokhwa::utils::{
    ApiBackend, CameraControl, CameraInfo, ControlValueSetter, FrameFormat, KnownCameraControl,
};

use super::*;
use crate::{Mode, Rate};
use relit_data::causes::with_causes;
use relit_data::clock::Clock;
use relit_data::session::FrameClock;

const TIMEOUT: Duration = Duration::from_secs(20);
const MAX_DELAY: Duration = Duration::from_millis(50);

/// What the library does when a frame is requested.
enum Step {
    Frame(Vec<u8>),
    Fail,
    Panic,
}

struct Scripted {
    info: CameraInfo,
    format: CameraFormat,
    steps: Receiver<Step>,
}

fn mode(fourcc: &[u8; 4], width: u32, height: u32, fps: u32) -> CameraMode {
    CameraMode {
        fourcc: Fourcc(*fourcc),
        width,
        height,
        rate: Rate::new(fps, 1).unwrap(),
    }
}

fn refused(what: &str) -> NokhwaError {
    NokhwaError::ReadFrameError(what.to_owned())
}

impl CaptureBackendTrait for Scripted {
    fn backend(&self) -> ApiBackend {
        ApiBackend::Auto
    }
    fn camera_info(&self) -> &CameraInfo {
        &self.info
    }
    fn refresh_camera_format(&mut self) -> Result<(), NokhwaError> {
        Ok(())
    }
    fn camera_format(&self) -> CameraFormat {
        self.format
    }
    fn set_camera_format(&mut self, format: CameraFormat) -> Result<(), NokhwaError> {
        self.format = format;
        Ok(())
    }
    fn compatible_list_by_resolution(
        &mut self,
        _: FrameFormat,
    ) -> Result<HashMap<Resolution, Vec<u32>>, NokhwaError> {
        Ok(HashMap::new())
    }
    fn compatible_fourcc(&mut self) -> Result<Vec<FrameFormat>, NokhwaError> {
        Ok(vec![FrameFormat::MJPEG])
    }
    fn resolution(&self) -> Resolution {
        self.format.resolution()
    }
    fn set_resolution(&mut self, _: Resolution) -> Result<(), NokhwaError> {
        Ok(())
    }
    fn frame_rate(&self) -> u32 {
        self.format.frame_rate()
    }
    fn set_frame_rate(&mut self, _: u32) -> Result<(), NokhwaError> {
        Ok(())
    }
    fn frame_format(&self) -> FrameFormat {
        self.format.format()
    }
    fn set_frame_format(&mut self, _: FrameFormat) -> Result<(), NokhwaError> {
        Ok(())
    }
    fn camera_control(&self, _: KnownCameraControl) -> Result<CameraControl, NokhwaError> {
        Err(refused("not asked"))
    }
    fn camera_controls(&self) -> Result<Vec<CameraControl>, NokhwaError> {
        Err(refused("not asked"))
    }
    fn set_camera_control(
        &mut self,
        _: KnownCameraControl,
        _: ControlValueSetter,
    ) -> Result<(), NokhwaError> {
        Err(refused("not asked"))
    }
    fn open_stream(&mut self) -> Result<(), NokhwaError> {
        Ok(())
    }
    fn is_stream_open(&self) -> bool {
        true
    }
    fn frame(&mut self) -> Result<Buffer, NokhwaError> {
        match self.steps.recv() {
            Ok(Step::Frame(data)) => Ok(Buffer::new(
                self.format.resolution(),
                &data,
                self.format.format(),
            )),
            Ok(Step::Fail) => Err(refused("the cable is loose")),
            Ok(Step::Panic) | Err(_) => panic!("the device went away"),
        }
    }
    fn frame_raw(&mut self) -> Result<Cow<'_, [u8]>, NokhwaError> {
        Err(refused("not asked"))
    }
    fn stop_stream(&mut self) -> Result<(), NokhwaError> {
        Ok(())
    }
}

/// A camera, and the sender of what its library does.
fn camera() -> (NokhwaCamera, SyncSender<Step>) {
    let (script, steps) = sync_channel(0);
    let camera = NokhwaCamera::with_library(3, move || {
        let index = CameraIndex::Index(3);
        let scripted = Scripted {
            info: CameraInfo::new("Scripted", "", "", index.clone()),
            format: CameraFormat::new(Resolution::new(640, 480), FrameFormat::MJPEG, 30),
            steps,
        };
        Ok(Library::with_custom(
            index,
            ApiBackend::Auto,
            Box::new(scripted),
        ))
    });
    (camera.unwrap(), script)
}

fn started() -> (NokhwaCamera, SyncSender<Step>) {
    let (mut camera, script) = camera();
    let request = mode(b"GREY", 2, 1, 25);
    let granted = camera.start(&request).unwrap();
    assert_eq!(granted.differences(&request), [] as [&str; 0]);
    (camera, script)
}

#[test]
fn frames_come_without_a_counter_and_with_the_time_of_their_arrival() {
    let (mut camera, script) = started();
    let before = Clock::monotonic().now_us();
    script.send(Step::Frame(vec![1, 2])).unwrap();
    let frame = camera.next_frame(TIMEOUT).unwrap();
    let after = Clock::monotonic().now_us();
    assert_eq!((frame.fault(), frame.data), (None, vec![1, 2]));
    assert_eq!((frame.sequence, frame.clock), (None, FrameClock::Host));
    assert!((before..=after).contains(&frame.t_us));
    let late = camera.next_frame(MAX_DELAY).unwrap_err();
    assert!(matches!(late, CameraError::Timeout { .. }), "{late}");
}

#[test]
fn of_a_whole_buffer_only_the_jpeg_is_taken() {
    let (mut camera, script) = camera();
    camera.start(&mode(b"MJPG", 640, 480, 30)).unwrap();
    let jpeg = [0xff, 0xd8, 0xff, 0xda, 0, 2, 5, 0xff, 0xd9];
    let before = [4, 0xff, 0xd9, 0, 0];
    let buffer = [&jpeg[..], &before].concat();
    script.send(Step::Frame(buffer)).unwrap();
    assert_eq!(camera.next_frame(TIMEOUT).unwrap().data, jpeg);
}

#[test]
fn a_reader_that_is_slow_loses_the_newest_frames_and_no_stamp_is_late() {
    let (mut camera, script) = started();
    let count = u8::try_from(WAITING).unwrap();
    for n in 0..count + 4 {
        script.send(Step::Frame(vec![n, n])).unwrap();
    }
    let read: Vec<u8> = (0..count)
        .map(|_| camera.next_frame(TIMEOUT).unwrap().data[0])
        .collect();
    assert!(read.into_iter().eq(0..count));
    // The last of those above may have come when there was a place again.
    for _ in 0..2 {
        script.send(Step::Frame(vec![99, 99])).unwrap();
    }
    let next = camera.next_frame(TIMEOUT).unwrap();
    assert!([count + 3, 99].contains(&next.data[0]), "{next:?}");
}

#[test]
fn a_stream_is_stopped_and_started_again() {
    let (mut camera, script) = started();
    script.send(Step::Frame(vec![1, 2])).unwrap();
    camera.next_frame(TIMEOUT).unwrap();
    // Where the library is inside a call already, the call ends by a frame.
    let stopped = Arc::new(AtomicBool::new(false));
    let is_stopped = Arc::clone(&stopped);
    let last = std::thread::spawn(move || {
        while !is_stopped.load(Ordering::Relaxed)
            && script.try_send(Step::Frame(vec![3, 4])).is_err()
        {
            std::thread::yield_now();
        }
        script
    });
    camera.stop().unwrap();
    stopped.store(true, Ordering::Relaxed);
    let error = camera.next_frame(MAX_DELAY).unwrap_err();
    assert!(matches!(error, CameraError::NotStarted { .. }), "{error}");
    let script = last.join().unwrap();
    camera.start(&mode(b"GREY", 2, 1, 30)).unwrap();
    script.send(Step::Frame(vec![5, 6])).unwrap();
    assert_eq!(camera.next_frame(TIMEOUT).unwrap().data, [5, 6]);
}

#[test]
fn an_error_of_the_library_keeps_its_words_and_the_camera_starts_again() {
    let (mut camera, script) = started();
    script.send(Step::Fail).unwrap();
    let error = camera.next_frame(TIMEOUT).unwrap_err();
    let text = with_causes(&error);
    assert!(
        text.contains("nokhwa:3") && text.contains("the cable is loose"),
        "{text}"
    );
    camera.start(&mode(b"GREY", 2, 1, 30)).unwrap();
    script.send(Step::Frame(vec![1, 2])).unwrap();
    assert!(camera.next_frame(TIMEOUT).is_ok());
}

#[test]
fn a_library_that_panics_is_an_unplugged_camera() {
    let (mut camera, script) = started();
    script.send(Step::Panic).unwrap();
    for _ in 0..2 {
        let error = camera.next_frame(TIMEOUT).unwrap_err();
        assert!(matches!(error, CameraError::Unplugged { .. }), "{error}");
    }
    let error = camera.start(&mode(b"GREY", 2, 1, 25)).unwrap_err();
    assert!(matches!(error, CameraError::Unplugged { .. }), "{error}");
}

#[test]
fn what_a_camera_offers_has_the_format_that_is_set() {
    let (camera, _script) = camera();
    let shown: Vec<String> = camera.info().modes.iter().map(Mode::to_string).collect();
    assert_eq!(shown, ["MJPG 640x480, 30 frames/s"]);
    assert_eq!(camera.info().name, "Scripted");
}

#[test]
fn rates_of_one_size_are_one_mode() {
    let format = |width, rate, format| CameraFormat::new(Resolution::new(width, 480), format, rate);
    let modes = gathered(&[
        format(640, 30, FrameFormat::MJPEG),
        format(640, 15, FrameFormat::MJPEG),
        format(640, 30, FrameFormat::MJPEG),
        format(640, 30, FrameFormat::YUYV),
        format(640, 30, FrameFormat::RAWBGR),
        format(800, 0, FrameFormat::YUYV),
    ]);
    let shown: Vec<String> = modes.iter().map(Mode::to_string).collect();
    assert_eq!(
        shown,
        ["MJPG 640x480, 30, 15 frames/s", "YUYV 640x480, 30 frames/s"]
    );
}

#[test]
fn a_number_that_is_no_camera_is_told() {
    let error = NokhwaCamera::open(4_000_000).err().unwrap();
    let text = with_causes(&error);
    assert!(matches!(error, CameraError::Refused { .. }), "{error:?}");
    assert!(text.contains("nokhwa:4000000"), "{text}");
    assert!(text.contains("No such file"), "{text}");
}
