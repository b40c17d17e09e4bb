//! Cameras under Linux, by the kernel's Video4Linux2 interface: the recording path.

mod controls;
mod device;
mod ioctl;
mod listing;
mod modes;
mod stream;

use std::path::Path;
use std::time::Duration;

use self::device::Device;
use self::stream::Stream;
use super::{Camera, CameraError, CameraMode, Control, DeviceInfo, Frame, Mode};

pub(super) use listing::list;

/// A V4L2 device.
pub(super) struct V4l2Camera {
    device: Device,
    info: DeviceInfo,
    stream: Option<Stream>,
}

impl V4l2Camera {
    pub(super) fn open(path: &Path) -> Result<Self, CameraError> {
        let (device, info) = Device::open(path)?;
        Ok(Self {
            device,
            info,
            stream: None,
        })
    }
}

impl Camera for V4l2Camera {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn claim(&mut self) -> Result<(), CameraError> {
        self.device.claim()
    }

    fn modes(&mut self) -> Result<Vec<Mode>, CameraError> {
        self.device.modes()
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        self.device.controls()
    }

    fn set_control(&mut self, id: u32, value: i64) -> Result<i64, CameraError> {
        self.device.set_control(id, value)
    }

    fn start(&mut self, want: &CameraMode) -> Result<CameraMode, CameraError> {
        // The driver takes no new format while it has buffers. An error of stopping shows again in the
        // next call.
        let _ = self.stop();
        let (stream, granted) = Stream::start(&self.device, want)?;
        self.stream = Some(stream);
        Ok(granted)
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError> {
        match &mut self.stream {
            Some(stream) => stream.next(&self.device, timeout),
            None => Err(CameraError::NotStarted {
                device: self.device.name(),
            }),
        }
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        match self.stream.take() {
            Some(stream) => stream.stop(&self.device),
            None => Ok(()),
        }
    }
}

impl Drop for V4l2Camera {
    fn drop(&mut self) {
        // An error does not matter: closing the node stops the stream as well.
        let _ = self.stop();
    }
}
