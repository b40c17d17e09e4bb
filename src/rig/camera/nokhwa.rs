//! Cameras by the portable library nokhwa: for lists and previews on systems without V4L2. It is
//! tried out under Linux only, where the library uses V4L2 itself.
//!
//! The library waits for a frame without limit, and some of its parts panic where a device goes
//! away. So each stream has a thread of its own, which owns the library's camera; whoever wants a
//! frame waits at a bounded queue for as long as allowed. What the library does not give (driver's
//! counters and time stamps, controls) is absent here too.

use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use ::nokhwa::pixel_format::RgbFormat;
use ::nokhwa::utils::{
    ApiBackend, CameraFormat, CameraIndex, FrameFormat, RequestedFormat, RequestedFormatType,
    Resolution,
};
use ::nokhwa::{Camera as Library, NokhwaError, query};

use super::{
    Camera, CameraAddress, CameraError, Capabilities, Control, ControlId, DeviceInfo, Fourcc,
    Frame, GrantedMode, Mode, ModeRequest, Rate, Rates, Sizes, StampSource,
};
use crate::clock::Clock;

/// Longest wait for the library to open a camera or start its stream.
const OPENING: Duration = Duration::from_secs(10);
/// Longest wait for the library to let go of a camera.
const CLOSING: Duration = Duration::from_secs(2);
/// Frames that may wait to be fetched.
const WAITING: usize = 2;

const CAPABILITIES: Capabilities = Capabilities {
    sequence: false,
    driver_time: false,
    controls: false,
};

/// A camera by its number in the library's list.
pub(super) struct NokhwaCamera {
    number: u32,
    info: DeviceInfo,
    stream: Option<Stream>,
}

/// The receiving ends of a stream's thread.
struct Stream {
    frames: Receiver<Result<Frame, NokhwaError>>,
    /// Is closed when the thread has let go of the camera.
    ended: Receiver<()>,
}

/// Cameras that the library finds; what one of them offers shows when it is opened.
#[cfg(any(test, not(target_os = "linux")))]
pub(super) fn list() -> Vec<DeviceInfo> {
    let found = query(ApiBackend::Auto).unwrap_or_default();
    let numbered = found.iter().filter_map(|camera| {
        let number = camera.index().as_index().ok()?;
        Some(describe(number, camera.human_name(), Vec::new()))
    });
    numbered.collect()
}

fn describe(number: u32, name: String, modes: Vec<Mode>) -> DeviceInfo {
    DeviceInfo {
        address: CameraAddress::Nokhwa(number),
        name,
        driver: "nokhwa".to_owned(),
        bus: String::new(),
        modes,
        other_formats: Vec::new(),
        capabilities: CAPABILITIES,
        problems: Vec::new(),
    }
}

impl NokhwaCamera {
    pub(super) fn open(number: u32) -> Result<Self, CameraError> {
        let doing = "it was opened";
        let found = query(ApiBackend::Auto).map_err(|error| failed(number, doing, &error))?;
        let listed = found
            .iter()
            .find(|camera| camera.index().as_index().is_ok_and(|index| index == number));
        let name = listed.map(|camera| camera.human_name());
        let name = name.ok_or_else(|| CameraError::NotThere {
            device: device(number),
            source: None,
        })?;
        let modes = modes(number)?;
        Ok(Self {
            number,
            info: describe(number, name, modes),
            stream: None,
        })
    }

    fn absent<T>(&self, what: &'static str) -> Result<T, CameraError> {
        Err(CameraError::Unsupported {
            device: device(self.number),
            what,
        })
    }
}

impl Camera for NokhwaCamera {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn modes(&mut self) -> Result<Vec<Mode>, CameraError> {
        Ok(self.info.modes.clone())
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        self.absent("its controls are out of reach; under Linux, give it as v4l2:/dev/videoN")
    }

    fn set_control(&mut self, _: ControlId, _: i64) -> Result<i64, CameraError> {
        self.absent("its controls are out of reach; under Linux, give it as v4l2:/dev/videoN")
    }

    fn start(&mut self, want: &ModeRequest) -> Result<GrantedMode, CameraError> {
        self.stop()?;
        let format = library_format(want.fourcc).ok_or_else(|| CameraError::Format {
            device: device(self.number),
            fourcc: want.fourcc,
        })?;
        let rate = want.rate.per_second().round() as u32;
        let format = CameraFormat::new(Resolution::new(want.width, want.height), format, rate);
        let number = self.number;
        let (sender, frames) = sync_channel(WAITING);
        let (running, ended) = sync_channel(0);
        let granted = on_thread(number, "its stream was started", move |answer| {
            run(number, format, &answer, &sender);
            drop::<SyncSender<()>>(running);
        })?;
        self.stream = Some(Stream { frames, ended });
        Ok(granted)
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError> {
        let device = device(self.number);
        let Some(stream) = &self.stream else {
            return Err(CameraError::NotStarted { device });
        };
        let doing = "a frame was read";
        match stream.frames.recv_timeout(timeout) {
            Ok(frame) => frame.map_err(|error| failed(self.number, doing, &error)),
            Err(RecvTimeoutError::Timeout) => Err(CameraError::Timeout {
                device,
                waited: timeout,
            }),
            Err(RecvTimeoutError::Disconnected) => Err(CameraError::Unplugged {
                device,
                source: None,
            }),
        }
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        if let Some(Stream { frames, ended }) = self.stream.take() {
            // The stream's thread ends when nobody fetches its next frame. One that hangs in the
            // library is left behind.
            drop(frames);
            let _ = ended.recv_timeout(CLOSING);
        }
        Ok(())
    }
}

impl Drop for NokhwaCamera {
    fn drop(&mut self) {
        // Never fails.
        let _ = self.stop();
    }
}

fn device(number: u32) -> String {
    CameraAddress::Nokhwa(number).to_string()
}

fn failed(number: u32, doing: &'static str, error: &NokhwaError) -> CameraError {
    CameraError::Backend {
        device: device(number),
        doing,
        source: Box::new(error.clone()),
    }
}

/// Runs work with the library on a thread of its own, and waits for its answer.
fn on_thread<T: Send + 'static>(
    number: u32,
    doing: &'static str,
    work: impl FnOnce(SyncSender<Result<T, NokhwaError>>) + Send + 'static,
) -> Result<T, CameraError> {
    let (sender, receiver) = sync_channel(1);
    let builder = thread::Builder::new().name("nokhwa".to_owned());
    let started = builder.spawn(move || work(sender));
    let broken = |why: String| CameraError::Backend {
        device: device(number),
        doing,
        source: why.into(),
    };
    started.map_err(|error| broken(error.to_string()))?;
    match receiver.recv_timeout(OPENING) {
        Ok(answer) => answer.map_err(|error| failed(number, doing, &error)),
        Err(RecvTimeoutError::Timeout) => Err(CameraError::Timeout {
            device: device(number),
            waited: OPENING,
        }),
        Err(RecvTimeoutError::Disconnected) => Err(broken("the library gave up".to_owned())),
    }
}

fn modes(number: u32) -> Result<Vec<Mode>, CameraError> {
    let formats = on_thread(number, "its modes were read", move |answer| {
        let index = CameraIndex::Index(number);
        let any = RequestedFormat::new::<RgbFormat>(RequestedFormatType::None);
        let formats =
            Library::new(index, any).and_then(|mut camera| camera.compatible_camera_formats());
        // Nobody waits any more where opening took too long.
        let _ = answer.send(formats);
    })?;
    Ok(gathered(&formats))
}

/// Formats of one size, joined to modes with all their rates.
fn gathered(formats: &[CameraFormat]) -> Vec<Mode> {
    let mut modes: Vec<Mode> = Vec::new();
    for format in formats {
        let (Some(fourcc), Some(rate)) =
            (fourcc(format.format()), Rate::new(format.frame_rate(), 1))
        else {
            continue;
        };
        let sizes = Sizes::One(format.width(), format.height());
        let same = modes
            .iter_mut()
            .find(|mode| (mode.fourcc, mode.sizes) == (fourcc, sizes));
        match same.map(|mode| &mut mode.rates) {
            Some(Rates::List(rates)) if !rates.contains(&rate) => rates.push(rate),
            Some(_) => {}
            None => modes.push(Mode {
                fourcc,
                sizes,
                rates: Rates::List(vec![rate]),
            }),
        }
    }
    modes
}

fn fourcc(format: FrameFormat) -> Option<Fourcc> {
    match format {
        FrameFormat::MJPEG => Some(Fourcc::MJPG),
        FrameFormat::YUYV => Some(Fourcc::YUYV),
        FrameFormat::NV12 => Some(Fourcc::NV12),
        FrameFormat::GRAY => Some(Fourcc::GREY),
        FrameFormat::RAWRGB => Some(Fourcc::RGB3),
        FrameFormat::RAWBGR => None,
    }
}

fn library_format(wanted: Fourcc) -> Option<FrameFormat> {
    let formats = [
        FrameFormat::MJPEG,
        FrameFormat::YUYV,
        FrameFormat::NV12,
        FrameFormat::GRAY,
        FrameFormat::RAWRGB,
    ];
    formats
        .into_iter()
        .find(|&format| fourcc(format) == Some(wanted))
}

/// Opens the camera, answers what it granted, and sends frames until nobody fetches them.
fn run(
    number: u32,
    format: CameraFormat,
    answer: &SyncSender<Result<GrantedMode, NokhwaError>>,
    frames: &SyncSender<Result<Frame, NokhwaError>>,
) {
    let formats = [format.format()];
    let closest = RequestedFormatType::Closest(format);
    let wanted = RequestedFormat::with_formats(closest, &formats);
    let opened = Library::new(CameraIndex::Index(number), wanted)
        .and_then(|mut camera| camera.open_stream().map(|()| camera));
    let mut camera = match opened {
        Ok(camera) => camera,
        Err(error) => {
            let _ = answer.send(Err(error));
            return;
        }
    };
    let found = camera.camera_format();
    let granted = GrantedMode {
        // Only formats that have one were asked for.
        fourcc: fourcc(found.format()).unwrap_or(Fourcc::MJPG),
        width: found.width(),
        height: found.height(),
        rate: Rate::new(found.frame_rate(), 1),
    };
    if answer.send(Ok(granted)).is_err() {
        return;
    }
    loop {
        let frame = camera.frame().map(|buffer| Frame {
            fourcc: granted.fourcc,
            width: granted.width,
            height: granted.height,
            data: buffer.buffer().to_vec(),
            sequence: None,
            t_us: Clock::monotonic().now_us(),
            stamp: StampSource::Arrival,
            flagged: false,
        });
        let broken = frame.is_err();
        if frames.send(frame).is_err() || broken {
            return;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_of_one_size_are_one_mode() {
        let format =
            |width, rate, format| CameraFormat::new(Resolution::new(width, 480), format, rate);
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
        let expected = matches!(
            error,
            CameraError::NotThere { .. } | CameraError::Backend { .. }
        );
        assert!(expected, "{error}");
        assert!(error.to_string().contains("nokhwa:4000000"), "{error}");
    }

    #[test]
    fn work_that_dies_is_an_error() {
        let died = on_thread::<()>(7, "it was opened", drop);
        assert!(matches!(died, Err(CameraError::Backend { .. })), "{died:?}");
    }

    #[test]
    fn what_is_listed_names_the_address_to_open() {
        for info in list() {
            assert!(matches!(info.address, CameraAddress::Nokhwa(_)), "{info:?}");
            assert_eq!(info.capabilities, CAPABILITIES);
        }
    }

    #[test]
    fn formats_go_both_ways() {
        for wanted in [
            Fourcc::MJPG,
            Fourcc::YUYV,
            Fourcc::NV12,
            Fourcc::GREY,
            Fourcc::RGB3,
        ] {
            assert_eq!(library_format(wanted).and_then(fourcc), Some(wanted));
        }
        assert_eq!(library_format(Fourcc::H264), None);
    }
}
