//! What can go wrong with a camera.

use std::io;
use std::path::PathBuf;
use std::time::Duration;

use super::format::Fourcc;
use relit_data::session;
use relit_video as video;

/// How a user gets the right to use cameras.
const PERMITTING: &str = if cfg!(target_os = "linux") {
    "add the user to the group `video` and log in again"
} else {
    "let this program use the camera in the system's privacy settings"
};

/// Why a camera could not be found, set, or read. The system's error is the `source`:
/// [`relit_data::causes::with_causes`] writes both as one sentence.
#[derive(Debug, thiserror::Error)]
pub enum CameraError {
    /// A text that is not an address, and why not.
    #[error("{0}")]
    Address(String),
    /// No such device.
    #[error(
        "no camera at {device}: plug it in, or give another; `relit-capture devices` lists them"
    )]
    NotThere {
        /// The device.
        device: String,
        /// The system's answer, if there is one.
        source: Option<io::Error>,
    },
    /// The device may not be opened.
    #[error("{device} may not be opened by this user: {PERMITTING}")]
    NotPermitted {
        /// The device.
        device: String,
        /// The system's answer, if there is one.
        source: Option<io::Error>,
    },
    /// A device that delivers no frames, or not in a supported way.
    #[error("{device} cannot be used as a camera ({why}): give another device")]
    NotACamera {
        /// The device.
        device: String,
        /// What keeps it from being one.
        why: String,
        /// The system's answer, if there is one.
        source: Option<io::Error>,
    },
    /// Another program has the stream of the device.
    #[error(
        "{device} is in use by another program (`sudo fuser {device}` names it): close that one"
    )]
    InUse {
        /// The device.
        device: String,
        /// The system's answer.
        source: io::Error,
    },
    /// The bus has no bandwidth left for the stream.
    #[error(
        "the USB bus of {device} is full: ask for a smaller size, a lower rate or MJPG, or plug it in at another controller"
    )]
    BusFull {
        /// The device.
        device: String,
        /// The system's answer.
        source: io::Error,
    },
    /// The device is gone.
    #[error("{device} was unplugged: plug it in again and start again")]
    Unplugged {
        /// The device.
        device: String,
        /// The system's answer, if there is one.
        source: Option<io::Error>,
    },
    /// No frame came in time.
    #[error(
        "{device} gave no frame for {:.1} s: check its cable, and that its mode fits the bus",
        .waited.as_secs_f64()
    )]
    Timeout {
        /// The device.
        device: String,
        /// How long was waited.
        waited: Duration,
    },
    /// The driver reports an error of the running stream.
    #[error("the stream of {device} broke while it was {doing}: stop and start it again")]
    Stream {
        /// The device.
        device: String,
        /// What was done, as a participle: "read".
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
    /// A frame was requested before the start.
    #[error("{device} is not started: start it before asking for frames")]
    NotStarted {
        /// The device.
        device: String,
    },
    /// The device refused a request.
    #[error(
        "{device} refused when {doing}: close other programs that use it; if this persists, unplug it and plug it in again"
    )]
    Refused {
        /// The device.
        device: String,
        /// What was done: "its formats were read".
        doing: &'static str,
        /// What the system, or a library, answers.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// A control could not be read or set.
    #[error("control {control:#010x} of {device} cannot be {doing}: {fault}")]
    Control {
        /// The device.
        device: String,
        /// The control's number.
        control: u32,
        /// What was done, as a participle: "set to 5".
        doing: String,
        /// Why not.
        fault: String,
        /// The system's answer, if there is one.
        source: Option<io::Error>,
    },
    /// Something that this kind of camera does not have.
    #[error("{device} cannot do this: {what}")]
    Unsupported {
        /// The device.
        device: String,
        /// What it cannot do, and what can.
        what: String,
    },
    /// A replay has ended.
    #[error(
        "the recording {path} ends after {frames} frames: add `loop=1` to play it again and again"
    )]
    EndOfRecording {
        /// The recording.
        path: PathBuf,
        /// Frames delivered.
        frames: u64,
    },
    /// A recording that cannot be replayed.
    #[error("{path} cannot be replayed: {why}")]
    Replay {
        /// The recording.
        path: PathBuf,
        /// Why, and what to do.
        why: String,
    },
    /// The session of a replay cannot be read.
    #[error(transparent)]
    Session(#[from] session::SessionError),
    /// The video of a replay cannot be read.
    #[error(transparent)]
    Video(#[from] video::VideoError),
}

impl CameraError {
    /// That frames of a format cannot be recorded.
    pub fn format(device: String, fourcc: Fourcc) -> Self {
        let what = format!(
            "{fourcc} frames cannot be recorded; ask for MJPG, H264, YUYV, NV12, RGB3, GREY or 8-bit Bayer"
        );
        Self::Unsupported { device, what }
    }
}
