//! What keeps a turn from being captured, each with the way out.

use std::io;
use std::path::PathBuf;

use jiff::Timestamp;

use super::recording::RecordingError;
use crate::camera::hold::ControlDrift;
use crate::camera::{CameraError, FrameFault};
use crate::lockfile::LockError;
use crate::simulator;
use crate::state::Obstacle;
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
    /// The camera is away.
    #[error("there is no camera at the moment: plug it in")]
    NoCamera,
    /// The table is away.
    #[error("there is no turntable at the moment: plug it in, or look at its fault")]
    NoTable,
    /// The camera lacks a control.
    #[error("the camera has no control {0:?}: `relit-capture devices` lists those that it has")]
    NoControl(String),
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
    pub(crate) fn system(
        what: impl Into<String>,
        doing: &'static str,
    ) -> impl FnOnce(io::Error) -> Self {
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
    /// No mode is as preferred.
    #[error("the camera does not offer {preferred}; it offers {}", first_of(.offered))]
    NoMode {
        /// What was asked for, in words.
        preferred: String,
        /// The modes that there are.
        offered: Vec<String>,
    },
    /// The camera grants another mode than the one asked for; in what it differs.
    #[error("the camera grants {}: ask for a mode that `relit-capture devices` lists", .0.join(", "))]
    OtherMode(Vec<String>),
    /// All of the first frames, so many, were damaged; what is wrong with the last.
    #[error(
        "the camera's first {0} frames were damaged ({1}): check its cable, or ask for another mode"
    )]
    Damaged(usize, #[source] FrameFault),
    /// Controls do not stay as they are set.
    #[error("the camera does not keep its settings: {}; close other programs that use it, or give values that it takes", joined(.0))]
    NotKept(Vec<ControlDrift>),
    /// Values that were asked for, and which the camera has no control to hold.
    #[error("the camera cannot be set to {}: leave that out, or set it at the camera", .0.join(", "))]
    NotHeld(Vec<String>),
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
    /// The battery is low.
    #[error("the table's battery has {volts:.2} V and {least:.2} V are demanded: charge it")]
    Battery {
        /// Volts it has.
        volts: f64,
        /// Volts it should have.
        least: f64,
    },
    /// The battery is not measured.
    #[error("the table does not report its battery's voltage: leave --min-battery out")]
    NoBattery,
    /// The time of day cannot be right.
    #[error(
        "the system's clock says {0}, before this program was written: set it, or the session's name would be wrong"
    )]
    Clock(Timestamp),
    /// The object's name cannot be part of a session's.
    #[error(
        "{0:?} cannot be an object's name: use letters, digits, '-', '_' and '.', at most 80 bytes"
    )]
    Object(String),
    /// The table does not turn as fast as asked for.
    #[error("{}", Obstacle::TooFast(*.set, *.highest))]
    TooFast {
        /// The speed that was asked for, degrees/s.
        set: f64,
        /// The table's highest speed, degrees/s.
        highest: f64,
    },
    /// Metering without a table.
    #[error("metering turns the table, and there is none: give --turntable, or set the exposure")]
    MeterWithoutTable,
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
    /// The camera gives another value than was set.
    #[error("the exposure was set to {set} and reads {read}: leave --meter out")]
    NotTaken {
        /// As set.
        set: i64,
        /// As read back.
        read: i64,
    },
    /// No picture could be decoded.
    #[error("the camera's pictures cannot be decoded: ask for another format")]
    NoPicture(#[source] relit_video::DecodeFault),
}

fn joined(drifts: &[ControlDrift]) -> String {
    let drifts: Vec<String> = drifts.iter().map(ControlDrift::to_string).collect();
    drifts.join(", ")
}

/// The first of a long list.
fn first_of(offered: &[String]) -> String {
    const MOST: usize = 12;
    match offered.len() {
        0 => "nothing that can be recorded".to_owned(),
        n if n > MOST => format!("{} and {} more", offered[..MOST].join("; "), n - MOST),
        _ => offered.join("; "),
    }
}
