//! Cameras by the portable library nokhwa: the recording path where there is no V4L2, which is macOS.
//! It is tried out under Linux, where the library uses V4L2 itself.
//!
//! The library has neither frame counters nor time stamps of the monotonic clock: frames carry the
//! time at which this program got them. Their controls are not used: most cameras have none there, and none that
//! holds an exposure.

mod worker;

use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use ::nokhwa::pixel_format::RgbFormat;
use ::nokhwa::utils::{
    CameraFormat, CameraIndex, FrameFormat, RequestedFormat, RequestedFormatType, Resolution,
};
use ::nokhwa::{Camera as Library, NokhwaError, nokhwa_check, nokhwa_initialize};
use relit_video::PixelFormat;

use self::worker::{FrameResult, WorkerHandle};
use super::{
    Camera, CameraAddress, CameraError, CameraMode, Control, DeviceInfo, Fourcc, Frame, Mode, Rate,
    Rates, Sizes,
};

/// Longest wait for the user's permission to use the camera.
const PERMITTING: Duration = Duration::from_secs(60);
/// Frames in the queue: at 30 frames/s, a quarter of a second.
const WAITING: usize = 8;

/// A camera by its number in the library's list.
pub(super) struct NokhwaCamera {
    info: DeviceInfo,
    worker: WorkerHandle,
    frames: Option<Receiver<FrameResult>>,
}

/// Cameras that the library finds; what one of them offers shows when it is opened.
#[cfg(target_os = "macos")]
pub(super) fn list() -> Vec<DeviceInfo> {
    use ::nokhwa::{query, utils::ApiBackend};
    let found = query(ApiBackend::Auto).unwrap_or_default();
    let numbered = found.iter().filter_map(|camera| {
        let number = camera.index().as_index().ok()?;
        Some(describe(number, camera.human_name()))
    });
    numbered.collect()
}

fn describe(number: u32, name: String) -> DeviceInfo {
    DeviceInfo {
        address: CameraAddress::Nokhwa(number),
        name,
        driver: "nokhwa".to_owned(),
        bus: String::new(),
        modes: Vec::new(),
        problems: Vec::new(),
    }
}

impl NokhwaCamera {
    pub(super) fn open(number: u32) -> Result<Self, CameraError> {
        if !permitted() {
            return Err(CameraError::NotPermitted {
                device: CameraAddress::Nokhwa(number).to_string(),
                source: None,
            });
        }
        Self::with_library(number, move || {
            let first = RequestedFormat::new::<RgbFormat>(RequestedFormatType::None);
            Library::new(CameraIndex::Index(number), first)
        })
    }

    fn with_library(
        number: u32,
        open: impl FnOnce() -> Result<Library, NokhwaError> + Send + 'static,
    ) -> Result<Self, CameraError> {
        let worker = WorkerHandle::start(CameraAddress::Nokhwa(number).to_string(), open)?;
        let (name, formats) = worker.ask("its modes were read", |owner| {
            let mut formats = owner.library.compatible_camera_formats()?;
            // Some systems leave out the current one.
            formats.push(owner.library.camera_format());
            Ok((owner.library.info().human_name(), formats))
        })?;
        let mut info = describe(number, name);
        info.modes = gathered(&formats);
        Ok(Self {
            info,
            worker,
            frames: None,
        })
    }

    fn device(&self) -> String {
        self.info.address.to_string()
    }
}

/// Whether the system lets this program use cameras; macOS asks the user.
fn permitted() -> bool {
    if nokhwa_check() {
        return true;
    }
    let (sender, answer) = sync_channel(1);
    nokhwa_initialize(move |granted| {
        // The receiver is gone if the answer is late.
        let _ = sender.try_send(granted);
    });
    answer.recv_timeout(PERMITTING).unwrap_or(false)
}

impl Camera for NokhwaCamera {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn modes(&mut self) -> Result<Vec<Mode>, CameraError> {
        Ok(self.info.modes.clone())
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        Ok(Vec::new())
    }

    fn set_control(&mut self, _: u32, _: i64) -> Result<i64, CameraError> {
        Err(CameraError::Unsupported {
            device: self.device(),
            what: "its controls are set by the system".to_owned(),
        })
    }

    fn start(&mut self, want: &CameraMode) -> Result<CameraMode, CameraError> {
        self.stop()?;
        let format = want.fourcc.pixel_format().and_then(library_format);
        let format = format.ok_or_else(|| CameraError::format(self.device(), want.fourcc))?;
        let rate = want.rate.per_second().round() as u32;
        let wanted = CameraFormat::new(Resolution::new(want.width, want.height), format, rate);
        let (sender, frames) = sync_channel(WAITING);
        let found = self.worker.ask("its stream was started", move |owner| {
            owner.start(wanted, sender)
        })?;
        self.frames = Some(frames);
        Ok(CameraMode {
            // The stream is of a format that has one.
            fourcc: fourcc(found.format()).unwrap_or(want.fourcc),
            width: found.width(),
            height: found.height(),
            rate: Rate::new(found.frame_rate(), 1).unwrap_or(want.rate),
        })
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError> {
        let device = self.device();
        let Some(frames) = &self.frames else {
            return Err(CameraError::NotStarted { device });
        };
        match frames.recv_timeout(timeout) {
            Ok(frame) => frame.map_err(|error| self.worker.failed("a frame was read", error)),
            Err(RecvTimeoutError::Timeout) => Err(CameraError::Timeout {
                device,
                waited: timeout,
            }),
            Err(RecvTimeoutError::Disconnected) => Err(self.worker.gone()),
        }
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        match self.frames.take() {
            Some(_) => self
                .worker
                .ask("its stream was stopped", worker::WorkerThread::stop),
            None => Ok(()),
        }
    }
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

/// The code of what the library calls a format.
fn fourcc(format: FrameFormat) -> Option<Fourcc> {
    let mut formats = PixelFormat::ALL.into_iter();
    let found = formats.find(|&known| library_format(known) == Some(format))?;
    Some(Fourcc::from_pixel_format(found))
}

fn library_format(wanted: PixelFormat) -> Option<FrameFormat> {
    match wanted {
        PixelFormat::Mjpeg => Some(FrameFormat::MJPEG),
        PixelFormat::Yuyv => Some(FrameFormat::YUYV),
        PixelFormat::Nv12 => Some(FrameFormat::NV12),
        PixelFormat::Grey => Some(FrameFormat::GRAY),
        PixelFormat::Rgb24 => Some(FrameFormat::RAWRGB),
        PixelFormat::H264 | PixelFormat::Bayer(_) => None,
    }
}

#[cfg(test)]
mod tests;
