//! Cameras: which there are, what they offer, and their frames with counters and time stamps.
//!
//! A [`Camera`] is one of three. *V4L2* is the recording path: the kernel's own buffers, counters
//! and monotonic time stamps. *nokhwa* lists and shows cameras on systems without V4L2; what it
//! cannot give is named in [`Capabilities`]. A *replay* is a recorded session or video that behaves
//! as the camera it was recorded with, at its own pace or faster, with faults on demand; a whole
//! capture runs on it without hardware.
//!
//! Frames are handed out as they came: this room counts nothing, judges nothing, and knows nothing
//! of turntables, captures or masks. [`hold::ManualPlan`] says which controls to set so that
//! exposure, gain, white balance and focus stand still; it is a pure function over the list of
//! controls.

mod address;
mod control;
mod error;
mod format;
mod frame;
pub mod hold;
mod nokhwa;
mod rate;
mod replay;
mod request;
#[cfg(target_os = "linux")]
mod v4l2;

use std::path::Path;
use std::time::Duration;

pub use address::{CameraAddress, ReplayFaults, ReplaySpeed};
pub use control::{Control, ControlFlags, ControlId, ControlKind, MenuItem, snake_case};
pub use error::{AddressFault, CameraError, ControlFault};
pub use format::{Fourcc, Mode, Rates, Sizes};
pub use frame::{Frame, FrameFault, Sequence, SequenceUnwrapper, StampSource, jpeg_size};
pub use rate::Rate;
pub use request::{GrantedMode, ModeRequest};

use crate::clock::Clock;

/// Opens a camera. A replay goes by the clock given; see [`CameraAddress::clock`].
///
/// # Errors
/// [`CameraError::NotThere`], [`CameraError::NotPermitted`], [`CameraError::NotACamera`],
/// [`CameraError::InUse`], what a recording's session or video answers, or what the device does.
pub fn open(address: &CameraAddress, clock: Clock) -> Result<Box<dyn Camera>, CameraError> {
    Ok(match address {
        CameraAddress::V4l2(path) => open_v4l2(path)?,
        CameraAddress::Nokhwa(number) => Box::new(nokhwa::NokhwaCamera::open(*number)?),
        CameraAddress::Replay {
            path,
            speed,
            repeat,
            faults,
        } => {
            let replay = replay::ReplayCamera::open(path, *speed, *repeat, faults, clock)?;
            Box::new(replay)
        }
    })
}

#[cfg(target_os = "linux")]
fn open_v4l2(path: &Path) -> Result<Box<dyn Camera>, CameraError> {
    Ok(Box::new(v4l2::V4l2Camera::open(path)?))
}

#[cfg(not(target_os = "linux"))]
fn open_v4l2(path: &Path) -> Result<Box<dyn Camera>, CameraError> {
    Err(CameraError::Unsupported {
        device: path.display().to_string(),
        what: "V4L2 is Linux's; give the camera as nokhwa:0",
    })
}

/// All cameras of this system, with what they offer and what of them could not be read: V4L2's
/// under Linux, else those that nokhwa finds.
pub fn list() -> Vec<DeviceInfo> {
    #[cfg(target_os = "linux")]
    return v4l2::list();
    #[cfg(not(target_os = "linux"))]
    return nokhwa::list();
}

/// A camera that may be started and stopped any number of times.
pub trait Camera: Send {
    /// What the camera said of itself when it was opened.
    fn info(&self) -> &DeviceInfo;

    /// What it offers, of formats that are taken here.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`], or what the device answers.
    fn modes(&mut self) -> Result<Vec<Mode>, CameraError>;

    /// All controls with one number as value, as they stand now.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`], or what the device answers.
    fn controls(&mut self) -> Result<Vec<Control>, CameraError>;

    /// Sets a control, and answers the value read back, which drivers round and clamp. A button
    /// answers the value given.
    ///
    /// # Errors
    /// [`CameraError::Control`], [`CameraError::Unplugged`], or [`CameraError::Unsupported`].
    fn set_control(&mut self, id: ControlId, value: i64) -> Result<i64, CameraError>;

    /// Starts the stream and answers what was granted, which need not be what was asked:
    /// [`GrantedMode::differences`]. A running stream is stopped first.
    ///
    /// # Errors
    /// [`CameraError::InUse`], [`CameraError::Format`], [`CameraError::Unplugged`], or what the
    /// device answers; the camera is then stopped and may be started again.
    fn start(&mut self, want: &ModeRequest) -> Result<GrantedMode, CameraError>;

    /// The next frame, in order. Waits for at most `timeout`, of real time or, for a replay, of its
    /// clock.
    ///
    /// # Errors
    /// [`CameraError::Timeout`] (the stream goes on), [`CameraError::Unplugged`],
    /// [`CameraError::Stream`], [`CameraError::NotStarted`] or [`CameraError::EndOfRecording`].
    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError>;

    /// Stops the stream; a stopped camera stays as it is.
    ///
    /// # Errors
    /// [`CameraError::Unplugged`] or what the device answers; the camera counts as stopped.
    fn stop(&mut self) -> Result<(), CameraError>;
}

/// What a camera says of itself.
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
    /// What it offers, of formats that are taken here.
    pub modes: Vec<Mode>,
    /// What else it offers.
    pub other_formats: Vec<Fourcc>,
    /// What can be relied on.
    pub capabilities: Capabilities,
    /// What could not be read, and why.
    pub problems: Vec<String>,
}

/// What can be relied on in a camera's frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Capabilities {
    /// Frames are counted by the driver, so that a dropped one shows.
    pub sequence: bool,
    /// Frames carry the driver's own time stamps.
    pub driver_time: bool,
    /// Controls can be read and set.
    pub controls: bool,
}
