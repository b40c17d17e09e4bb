//! What every kind of camera offers.

use std::time::Duration;

use super::address::CameraAddress;
use super::control::Control;
use super::error::CameraError;
use super::format::Mode;
use super::frame::Frame;
use super::mode::CameraMode;

/// A camera that may be started and stopped any number of times.
pub trait Camera: Send {
    /// The camera's description when it was opened.
    fn info(&self) -> &DeviceInfo;

    /// Takes the camera for this process until it is closed; others may look at it, and not claim it. Of cameras that
    /// any number of programs can have, nothing is taken.
    ///
    /// # Errors
    /// [`CameraError::InUse`].
    fn claim(&mut self) -> Result<(), CameraError> {
        Ok(())
    }

    /// The modes it offers, in formats that can be recorded.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`], or another error of the device.
    fn modes(&mut self) -> Result<Vec<Mode>, CameraError>;

    /// All controls with one number as value, and their current values.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`], or another error of the device.
    fn controls(&mut self) -> Result<Vec<Control>, CameraError>;

    /// Sets a control, and returns the value read back, which drivers round and clamp. For a button
    /// it returns the given value.
    ///
    /// # Errors
    /// [`CameraError::Control`], [`CameraError::Unplugged`], or [`CameraError::Unsupported`].
    fn set_control(&mut self, id: u32, value: i64) -> Result<i64, CameraError>;

    /// Starts the stream and returns what was granted, which may differ from the request:
    /// [`CameraMode::differences`]. A running stream is stopped first.
    ///
    /// # Errors
    /// [`CameraError::InUse`], [`CameraError::Unsupported`], [`CameraError::Unplugged`], or another
    /// error of the device; the camera is then stopped and may be started again.
    fn start(&mut self, want: &CameraMode) -> Result<CameraMode, CameraError>;

    /// The next frame, in order. Waits for at most `timeout`, of real time or, for a replay, of its
    /// clock.
    ///
    /// # Errors
    /// [`CameraError::Timeout`] (the stream continues), [`CameraError::Unplugged`],
    /// [`CameraError::Stream`], [`CameraError::NotStarted`] or [`CameraError::EndOfRecording`].
    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError>;

    /// Stops the stream; a stopped camera stays as it is.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`] or another error of the device; the camera counts as stopped.
    fn stop(&mut self) -> Result<(), CameraError>;
}

/// The description of a camera.
#[derive(Debug, Clone, PartialEq)]
pub struct DeviceInfo {
    /// How to open it again.
    pub address: CameraAddress,
    /// Its name, such as "HD Pro Webcam C920".
    pub name: String,
    /// The driver, such as `uvcvideo`.
    pub driver: String,
    /// Where it is plugged in, such as `usb-0000:00:14.0-2`.
    pub bus: String,
    /// The modes it offers, in formats that can be recorded.
    pub modes: Vec<Mode>,
    /// What could not be read, and why.
    pub problems: Vec<String>,
}
