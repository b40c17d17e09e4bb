//! What keeps a turn from being captured, each with the way out.

use std::io;
use std::path::PathBuf;

use super::recording::RecordingError;
use relit_camera::CameraError;
use relit_turntable::TurntableError;
use relit_turntable::simulator;

/// Why a capture failed.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// Something was not as it has to be before the table turns.
    #[error("the capture did not start: {0}")]
    Refused(String),
    /// The camera.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// The table.
    #[error(transparent)]
    Turntable(#[from] TurntableError),
    /// It was stopped on purpose.
    #[error(transparent)]
    Stopped(#[from] StopReason),
    /// The recording.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The simulated table.
    #[error(transparent)]
    Simulator(#[from] simulator::SimulatorError),
    /// Something is not there at the moment; what, and what to do.
    #[error("{0}")]
    Missing(String),
    /// Another daemon has the folder of sessions.
    #[error("{root} is in use by {}: end that one first", .pid.map_or("another process".to_owned(), |pid| format!("process {pid}")))]
    InUse {
        /// The folder.
        root: PathBuf,
        /// Who has it, where that is known.
        pid: Option<u32>,
    },
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

    pub(crate) fn no_camera() -> Self {
        Self::Missing("no camera is connected: plug it in".to_owned())
    }
}

/// Who asked for the stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, thiserror::Error)]
pub enum StopReason {
    /// A person.
    #[error("stopped by a person")]
    Person,
    /// The program is to end.
    #[error("stopped because the program is ending")]
    Shutdown,
}
