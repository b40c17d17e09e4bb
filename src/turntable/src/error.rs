//! The errors of a turntable. Each message says what to do.

use std::path::PathBuf;
use std::time::Duration;

use super::codes::{Alarm, describe_error};
use super::protocol::{ControllerState, LineFault, SendError};
use super::supervisor::MotionFault;

/// An error of a turntable.
#[derive(Debug, thiserror::Error)]
pub enum TurntableError {
    /// The text is not an address.
    #[error(
        "{text:?} is not a turntable's address: {why}; use serial:/dev/ttyUSB0, serial: (looks for one), sim:, or none"
    )]
    Address {
        /// The text.
        text: String,
        /// What is wrong with it.
        why: String,
    },
    /// No USB serial adapter that controllers use was found.
    #[error(
        "no USB serial adapter of a turntable's controller was found: plug the controller in, or name its port, as in serial:/dev/ttyUSB0"
    )]
    NoCandidate,
    /// Several of them were found.
    #[error("several ports could be the turntable's: {}; name one, as in serial:{}",
        .0.join(", "), .0.first().map_or("/dev/ttyUSB0", |first| first.split(' ').next().unwrap_or(first)))]
    SeveralCandidates(
        /// Path and USB name of each.
        Vec<String>,
    ),
    /// Another process owns the port.
    #[error(
        "{} uses {path}: look at the table there, or end that process, which stops the table (`relit-capture turntable stop` does, from the account that runs it)",
        process_named(*.pid)
    )]
    Owned {
        /// The port.
        path: PathBuf,
        /// The owner, where that is known.
        pid: Option<u32>,
    },
    /// The port could not be opened.
    #[error(
        "{path} could not be opened: {source}; check that the controller is plugged in, not used by another program, and open to you (group dialout)"
    )]
    Open {
        /// The port.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// What was asked for cannot be done, or was not: what happened, and what to do.
    #[error("{0}")]
    Failed(String),
    /// The controller did not report something that is needed.
    #[error(
        "the controller does not report {0}: send `$$` and `$I` to it by hand and look at the answers"
    )]
    NotReported(String),
    /// The controller refused a line.
    #[error("the controller refused {block:?} with error:{code}, {}", describe_error(*.code))]
    Refused {
        /// The line.
        block: String,
        /// Grbl's number.
        code: u8,
    },
    /// A line got no answer.
    #[error(
        "{block:?} may or may not have reached the controller: {fault}; the table was stopped; check its position before you continue"
    )]
    Lost {
        /// The line.
        block: String,
        /// What happened.
        fault: LineFault,
    },
    /// A line was not sent.
    #[error("{block:?} was not sent: {why}")]
    Unsent {
        /// The line.
        block: String,
        /// Why.
        why: SendError,
    },
    /// The table is moving or being stopped already.
    #[error("the table is busy: it is moving or being stopped; wait, or stop it")]
    Busy,
    /// The table is not ready for a motion.
    #[error("the table is in state {state} and takes no motion: {}", advice(*.state, .alarm.as_ref()))]
    NotReady {
        /// Its state.
        state: ControllerState,
        /// The alarm that locked it.
        alarm: Option<Alarm>,
    },
    /// The emergency stop is pressed.
    #[error("the emergency stop is pressed: release it, then unlock and home the table")]
    EmergencyStop,
    /// The position is not known.
    #[error("the table's position is not known: home it first")]
    NotHomed,
    /// A speed or angle that the table cannot follow.
    #[error("{what} cannot be {value}: {range}")]
    OutOfRange {
        /// Which figure.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The valid range.
        range: String,
    },
    /// The turn does not fit between the limits.
    #[error(
        "no room for a turn from {from_deg:.3} degrees: it takes {forward_deg:.3} degrees onwards and {back_deg:.3} back, and the limits are {low_deg:.3} and {high_deg:.3}; {way_out}"
    )]
    NoRoom {
        /// Where the table stands.
        from_deg: f64,
        /// Degrees that the turn needs in its direction.
        forward_deg: f64,
        /// Degrees that it needs in the opposite direction, for its ramp.
        back_deg: f64,
        /// Lower limit.
        low_deg: f64,
        /// Upper limit.
        high_deg: f64,
        /// What to do.
        way_out: String,
    },
    /// A fault ended the motion.
    #[error("the motion failed: {0}")]
    Motion(#[from] MotionFault),
    /// The table was not reported at rest after a stop.
    #[error("the table did not report that it stopped: cut its power, then check the cable")]
    NotStopped,
}

impl TurntableError {
    /// That no report or answer came within a time limit.
    pub(super) fn silent(limit: Duration) -> Self {
        let milliseconds = limit.as_millis();
        Self::Failed(format!(
            "the table did not answer `?` within {milliseconds} ms: check cable and power"
        ))
    }
}

/// A process in a sentence.
fn process_named(pid: Option<u32>) -> String {
    pid.map_or("another process".to_owned(), |pid| format!("process {pid}"))
}

fn advice(state: ControllerState, alarm: Option<&Alarm>) -> String {
    match state {
        ControllerState::Alarm => {
            alarm.map_or_else(|| "unlock or home it".to_owned(), Alarm::to_string)
        }
        ControllerState::Held | ControllerState::Holding => "stop it first".to_owned(),
        ControllerState::Check => "switch Grbl's check mode off with `$C`".to_owned(),
        _ => "stop it, or wait until it is idle".to_owned(),
    }
}
