//! What keeps a turn from being captured, each with the way out.

use std::io;
use std::path::PathBuf;

use super::recording::RecordingError;
use crate::camera::CameraError;
use crate::lockfile::LockError;
use crate::simulator;
use crate::turntable::TurntableError;

/// Why there is no capture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// Something was not as it has to be before the table turns.
    #[error("the capture was not begun")]
    Refused(#[from] Refusal),
    /// No exposure was found.
    #[error("metering failed")]
    Meter(#[from] MeterFault),
    /// The camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The table.
    #[error(transparent)]
    Turntable(#[from] TurntableError),
    /// Somebody asked for it.
    #[error("the capture was stopped")]
    Stopped(#[from] Stopped),
    /// The recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The simulated table.
    #[error(transparent)]
    Simulator(#[from] simulator::SimulatorError),
    /// Something is not there at the moment; what, and what to do.
    #[error("{0}")]
    Missing(String),
    /// Another process has the camera or the folder, or that cannot be known.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// The recording ended before the turn, or long after it.
    #[error("the recording did not end with the turn")]
    NotWithTheTurn,
    /// A part of the machine could not be had.
    #[error("{what} could not be {doing}")]
    System {
        /// What was worked on.
        what: String,
        /// What was to be done, as a participle.
        doing: &'static str,
        /// The system's answer.
        source: io::Error,
    },
}

impl CaptureError {
    /// That `what` could not be `doing`, a participle: for `map_err`.
    pub fn system(what: impl Into<String>, doing: &'static str) -> impl FnOnce(io::Error) -> Self {
        let what = what.into();
        move |source| Self::System {
            what,
            doing,
            source,
        }
    }
}

/// Who asked for the stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum Stopped {
    /// A person.
    #[error("somebody asked for it")]
    Person,
    /// The program is to end.
    #[error("the program was told to end")]
    Shutdown,
}

/// What preflight found wrong; nothing has turned yet.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Refusal {
    /// A real camera or table beside a rehearsal that is to run faster.
    #[error(
        "a real camera or turntable goes by real time: leave speed= out of the other one's address"
    )]
    Pace,
    /// Too little space.
    #[error(
        "{folder} has {} MB free and the take needs {} MB (a fifth in reserve): free some space, or give another --root",
        .free / 1_000_000, .needed.div_ceil(1_000_000)
    )]
    DiskFull {
        /// The folder.
        folder: PathBuf,
        /// Bytes free.
        free: u64,
        /// Bytes needed, reserve included.
        needed: u64,
    },
    /// Anything else, with the way out.
    #[error("{0}")]
    Other(String),
}

impl CaptureError {
    pub(crate) fn no_camera() -> Self {
        Self::Missing("there is no camera at the moment: plug it in".to_owned())
    }
}

/// Why metering found no exposure.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeterFault {
    /// Too bright even at the darkest exposure.
    #[error(
        "{:.1} % of the middle saturate at the darkest exposure ({exposure}), and {:.1} % are allowed: less light, a smaller aperture or less gain",
        100.0 * .clipped, 100.0 * .allowed
    )]
    TooBright {
        /// The exposure, in the control's own units.
        exposure: i64,
        /// The part that saturates.
        clipped: f64,
        /// The part that may.
        allowed: f64,
    },
    /// The turns were over before all was seen.
    #[error(
        "{0} degrees of the turn were not seen at an exposure that holds: the light changes, or frames are missing; meter again, or set the exposure"
    )]
    Unseen(usize),
    /// The camera's exposure cannot be set.
    #[error("the camera's exposure cannot be set: leave --meter out")]
    NoExposure,
    /// No picture could be decoded.
    #[error("the camera's pictures cannot be decoded: ask for another format")]
    NoPicture(#[source] relit_video::DecodeFault),
}
