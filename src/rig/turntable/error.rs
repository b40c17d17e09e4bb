//! What can go wrong with a table, each with the way out.

use std::path::PathBuf;

use super::codes::{Alarm, meaning_of_error};
use super::wire::{LineFault, ResetCause, SendError, State};
use crate::lockfile::LockError;

/// Why a turntable could not be reached, or did not do what it was told.
#[derive(Debug, thiserror::Error)]
pub enum TurntableError {
    /// The text is no address.
    #[error(
        "{text:?} is no turntable's address: {why}; use serial:/dev/ttyUSB0, serial: (looks for one), sim:, or none"
    )]
    Address {
        /// The text.
        text: String,
        /// What is wrong with it.
        why: String,
    },
    /// No USB serial adapter that a controller has was found.
    #[error(
        "no USB serial adapter of a turntable's controller was found: plug the controller in, or name its port, as in serial:/dev/ttyUSB0"
    )]
    NoCandidate,
    /// Several were found.
    #[error("several ports could be the turntable's: {}; name one, as in serial:{}",
        .0.join(", "), .0.first().map_or("/dev/ttyUSB0", |first| first.split(' ').next().unwrap_or(first)))]
    SeveralCandidates(
        /// Path and USB name of each.
        Vec<String>,
    ),
    /// Another process owns the port.
    #[error(
        "process {pid} has {path}: ask it for `status` or `stop`, which reach the table through it, or end it first"
    )]
    Owned {
        /// The port.
        path: PathBuf,
        /// The owner.
        pid: u32,
    },
    /// The system gave no thread for the port.
    #[error("no thread could be started for the port: {0}; end other programs and try again")]
    Thread(std::io::Error),
    /// The port could not be opened.
    #[error(
        "{path} could not be opened: {source}; check that the controller is plugged in, that no other program has the port, and that you may use it (group dialout)"
    )]
    Open {
        /// The port.
        path: PathBuf,
        /// The system's answer.
        source: std::io::Error,
    },
    /// Lock, socket or folder of the port's owner could not be used.
    #[error(transparent)]
    Lock(#[from] LockError),
    /// The process that owns the port could not be asked.
    #[error("process {pid}, which has {path}, did not answer: {why}; ask again, or end it")]
    Owner {
        /// The port.
        path: PathBuf,
        /// The owner.
        pid: u32,
        /// What went wrong.
        why: String,
    },
    /// The port's owner answered that it could not do it.
    #[error("process {pid}, which has the port, says: {message}")]
    OwnerSays {
        /// The owner.
        pid: u32,
        /// Its words.
        message: String,
    },
    /// Nothing that speaks Grbl is behind the port.
    #[error(
        "{port} does not answer as a Grbl 1.1 controller ({heard}): check port, cable and power, and that its firmware is Grbl 1.1 or the rig's"
    )]
    NoController {
        /// The port.
        port: String,
        /// What was heard.
        heard: String,
    },
    /// The controller left out or garbled what has to be known of it.
    #[error(
        "the controller does not tell {0}: send `$$` and `$I` to it by hand and look at the answers"
    )]
    Untold(&'static str),
    /// No report came.
    #[error("the table did not answer `?` within {milliseconds} ms: check cable and power")]
    Silent {
        /// How long was waited, of the table's clock.
        milliseconds: u64,
    },
    /// A line was refused.
    #[error("the controller refused {block:?} with error:{code}, {}", meaning_of_error(*.code))]
    Refused {
        /// The line.
        block: String,
        /// Grbl's number.
        code: u8,
    },
    /// A line has no answer.
    #[error(
        "{block:?} may or may not have reached the controller: {fault}; the table was stopped, look at its position before you go on"
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
    /// Something else moves the table.
    #[error("the table is busy: it is moving or being stopped; wait, or stop it")]
    Busy,
    /// The table is not ready for a motion.
    #[error("the table is in state {state} and takes no motion: {}", advice(*.state, .alarm.as_ref()))]
    NotReady {
        /// Its state.
        state: State,
        /// The alarm that locked it.
        alarm: Option<Alarm>,
    },
    /// The position is not known.
    #[error("the table's position is not known: home it first")]
    NotHomed,
    /// The search for the index failed.
    #[error("homing failed: {0}")]
    Homing(Alarm),
    /// A figure is not one a table can follow.
    #[error("{what} cannot be {value}: {range}")]
    Figure {
        /// What it is for.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it may be.
        range: String,
    },
    /// A target is outside of the limits.
    #[error(
        "{target_deg:.3} degrees is beyond the limits {low_deg:.3} to {high_deg:.3}: go there the other way round, so that the cable unwinds"
    )]
    BeyondLimit {
        /// The target.
        target_deg: f64,
        /// Lower limit.
        low_deg: f64,
        /// Upper limit.
        high_deg: f64,
    },
    /// A turn does not fit.
    #[error(
        "no room for a turn from {from_deg:.3} degrees: it takes {forward_deg:.3} degrees onwards and {back_deg:.3} back, and the limits are {low_deg:.3} and {high_deg:.3}; {way_out}"
    )]
    NoRoom {
        /// Where the table stands.
        from_deg: f64,
        /// What the turn takes in its direction.
        forward_deg: f64,
        /// What it takes against it.
        back_deg: f64,
        /// Lower limit.
        low_deg: f64,
        /// Upper limit.
        high_deg: f64,
        /// What to do.
        way_out: String,
    },
    /// The table has moved since the turn was planned.
    #[error(
        "the turn was planned from {planned_deg:.3} degrees and the table stands at {at_deg:.3}: plan it anew"
    )]
    Moved {
        /// Where it was planned from.
        planned_deg: f64,
        /// Where the table stands.
        at_deg: f64,
    },
    /// A motion ended otherwise than it should have.
    #[error("the motion failed: {0}")]
    Motion(#[from] Fault),
    /// The table could not be seen at rest.
    #[error(
        "the table was told to stop and could not be seen at rest: cut its power, then check the cable"
    )]
    NotStopped,
    /// The table's angles do not make a turn.
    #[error("the turn's angles cannot be told: {0}")]
    Track(#[from] super::sync::TrackError),
}

/// Why a motion ended otherwise than it should have. The table is being stopped then, or has been.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// The controller restarted.
    #[error("the controller restarted{}, and its position is lost; check its supply and cable, then home it", .0.map_or_else(String::new, |cause| format!(" ({cause})")))]
    Restarted(Option<ResetCause>),
    /// An alarm.
    #[error("{0}")]
    Alarm(Alarm),
    /// The table was put on hold by somebody else.
    #[error(
        "the table was put on hold, and not by this program; look for a button or another sender, and start anew"
    )]
    Held,
    /// No report came.
    #[error("the controller was silent for {milliseconds} ms; check cable and power")]
    Silent {
        /// For how long.
        milliseconds: i64,
    },
    /// It reports motion and the same place.
    #[error("the controller reports motion and stays at {machine_deg:.3} degrees; restart it")]
    Stalled {
        /// The place, from machine zero.
        machine_deg: f64,
    },
    /// It stands elsewhere than it was sent, or does something else.
    #[error(
        "the table was sent to {target_deg:.3} degrees and is in state {state} at {machine_deg:.3} (from machine zero); the line to it was damaged or something else drives it"
    )]
    Astray {
        /// What it does.
        state: State,
        /// Where it is, from machine zero.
        machine_deg: f64,
        /// Where it was sent, from machine zero.
        target_deg: f64,
    },
    /// It did not arrive in time.
    #[error("the table did not arrive in time; compare its speed with the settings $110 and $120")]
    Late,
    /// A line was lost.
    #[error("the line that moves it may or may not have been taken: {0}")]
    Line(LineFault),
    /// The port is gone.
    #[error("the port is gone ({0}); check that the controller is plugged in")]
    PortLost(String),
    /// Somebody asked for a stop.
    #[error("a stop was asked for")]
    Stopped,
}

fn advice(state: State, alarm: Option<&Alarm>) -> String {
    match state {
        State::Alarm => alarm.map_or_else(|| "unlock or home it".to_owned(), Alarm::to_string),
        State::Held | State::Holding | State::Door => "stop it first".to_owned(),
        State::Check => "switch Grbl's check mode off with `$C`".to_owned(),
        State::Sleep => "wake it with a reset".to_owned(),
        _ => "stop it, or wait until it is idle".to_owned(),
    }
}
