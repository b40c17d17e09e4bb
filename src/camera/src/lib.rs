//! Cameras: which there are, what they offer, and their frames with counters and time stamps.
//!
//! A [`Camera`] is one of three. *V4L2* is the recording path under Linux: the kernel's own buffers,
//! counters and monotonic time stamps. *nokhwa* (feature `nokhwa`) records on systems without V4L2:
//! no counters, time stamps of the host's clock on arrival, and few controls. A *replay* is a
//! recorded session or video that behaves as the camera it was recorded with, at its own pace or
//! faster, with faults on demand; a whole capture runs on it without hardware.
//!
//! Frames are returned as the camera delivered them: this module neither counts nor judges them, and
//! knows nothing of turntables, captures or masks. [`manual_controls::ManualPlan`] decides which controls to set
//! so that exposure, gain, white balance and focus do not change; it is a pure function of the list
//! of controls.
//!
//! ```
//! use std::time::Duration;
//!
//! use relit_camera::{self as camera, CameraMode, Fourcc, Rate};
//! use relit_data::clock::Clock;
//!
//! # std::env::set_current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")).unwrap();
//! let address = "replay:fixtures/20261120T101500Z-cow-short".parse()?;
//! let mut camera = camera::open(&address, Clock::virtual_time())?;
//! let rate = Rate::from_per_second(30.0).ok_or("no rate")?;
//! camera.start(&CameraMode { fourcc: Fourcc::MJPG, width: 480, height: 360, rate })?;
//! let frame = camera.next_frame(Duration::from_secs(5))?;
//! assert_eq!((frame.width, frame.height, frame.fault()), (480, 360, None));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod address;
mod backend;
mod control;
mod error;
mod format;
mod frame;
pub mod manual_controls;
mod mode;
#[cfg(all(feature = "nokhwa", any(target_os = "linux", target_os = "macos")))]
mod nokhwa;
mod rate;
mod replay;
#[cfg(target_os = "linux")]
mod v4l2;

use std::path::Path;

pub use address::{CameraAddress, ReplayAddress, ReplayFaults};
pub use backend::{Camera, DeviceInfo};
pub use control::{Control, ControlFlags, ControlKind, MenuItem, snake_case};
pub use error::CameraError;
pub use format::{Fourcc, Mode, Rates, Sizes};
#[cfg(target_os = "linux")]
use frame::SequenceUnwrapper;
pub use frame::{Frame, FrameFault};
pub use mode::CameraMode;
pub use rate::Rate;

use relit_data::clock::Clock;

/// Opens a camera. A replay goes by the given clock, and as fast as that.
///
/// # Errors
/// [`CameraError::NotThere`], [`CameraError::NotPermitted`], [`CameraError::NotACamera`],
/// [`CameraError::InUse`], an error of a recording's session or video, or another error of the device.
pub fn open(address: &CameraAddress, clock: Clock) -> Result<Box<dyn Camera>, CameraError> {
    Ok(match address {
        CameraAddress::V4l2(path) => open_v4l2(path)?,
        CameraAddress::Nokhwa(number) => open_nokhwa(*number)?,
        CameraAddress::Replay(replay) => Box::new(replay::ReplayCamera::open(replay, clock)?),
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
        what: "V4L2 is Linux's; give the camera as nokhwa:0".to_owned(),
    })
}

#[cfg(all(feature = "nokhwa", any(target_os = "linux", target_os = "macos")))]
fn open_nokhwa(number: u32) -> Result<Box<dyn Camera>, CameraError> {
    Ok(Box::new(nokhwa::NokhwaCamera::open(number)?))
}

#[cfg(not(all(feature = "nokhwa", any(target_os = "linux", target_os = "macos"))))]
fn open_nokhwa(number: u32) -> Result<Box<dyn Camera>, CameraError> {
    Err(CameraError::Unsupported {
        device: CameraAddress::Nokhwa(number).to_string(),
        what: if cfg!(feature = "nokhwa") { "nokhwa has no cameras on this system; give a recording as replay:PATH" } else { 
                "this program was built without it; build it with the feature `nokhwa`, or give v4l2:/dev/video0"
             }
        .to_owned(),
    })
}

/// All cameras of this system, with what they offer and what could not be read: those of V4L2 under
/// Linux, otherwise those that nokhwa finds.
pub fn list() -> Vec<DeviceInfo> {
    #[cfg(target_os = "linux")]
    return v4l2::list();
    #[cfg(all(feature = "nokhwa", target_os = "macos"))]
    return nokhwa::list();
    #[cfg(not(any(target_os = "linux", all(feature = "nokhwa", target_os = "macos"))))]
    return Vec::new();
}
