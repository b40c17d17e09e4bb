//! The turntable: a client of Grbl 1.1's serial interface that trusts nothing.
//!
//! ```text
//! bytes <- port <- link (a thread) -> wire (lines, answers) -> supervisor (what is known, stops)
//!                                                    table, turn, plan, sync -> angles over time
//! ```
//!
//! It works with a stock Grbl 1.1 board on which one millimetre of X is one degree, and with the
//! rig's own firmware, whose extras it uses where `$I` offers them: reports with the chip's time,
//! lines with number and checksum, and a lease that stops the table when the host falls silent.
//!
//! A line counts as done only when its own answer has come; a motion only when the table was seen
//! at rest at its target. Whatever else happens (a restart, an alarm, silence, a hold that nobody
//! here asked for, a table that stands still or elsewhere) ends the motion with that reason and
//! stops the table. A position that may be lost is one that has to be homed again.
//!
//! This room knows neither cameras nor sessions, and shares no code with the firmware: both are
//! held to the published interface.

mod address;
mod codes;
mod error;
#[cfg(test)]
mod fake_grbl;
mod greeting;
mod homing;
mod identity;
mod link;
mod owner;
mod plan;
mod port;
mod status;
mod supervisor;
mod sync;
mod table;
#[cfg(test)]
mod tests;
mod turn;
pub mod wire;

use std::path::PathBuf;

use crate::clock::Clock;

pub use address::{SimulatedAddress, TurntableAddress, find_serial};
pub use codes::Alarm;
pub use error::{MotionFault, TurntableError};
pub use homing::Homed;
pub use identity::{Extras, Identity, TravelLimits};
pub use owner::Owner;
pub use plan::{Direction, TurnPlan, TurnRequest};
pub use port::{Port, SerialPort};
pub use status::TableStatus;
pub use sync::{Residuals, Track, TrackError};
pub use table::Table;
pub use turn::{ConstantPart, Turn, TurnPhase};
pub use wire::{ControllerState, Counts, LineFault, RestartCause, SendError};

/// The lease that a turn sets where it is off, seconds.
const LEASE_S: u32 = 3;

/// How a table is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct TableOptions {
    /// The clock that the table's times are told by. A simulated table that runs faster than real
    /// time needs the same clock as its simulator.
    pub clock: Clock,
    /// Where the owner of a port leaves its lock and its socket: `$XDG_RUNTIME_DIR`, or a folder
    /// that every program on the machine agrees on.
    pub runtime_folder: PathBuf,
    /// How far the table may turn either way from the angle 0 before its cable is wound up, where
    /// the controller itself watches no limit; degrees.
    pub travel_deg: f64,
    /// Whether what the rig's firmware offers beyond Grbl is used; without, it is spoken to as
    /// a stock board.
    pub extras: bool,
}

impl Default for TableOptions {
    fn default() -> Self {
        Self {
            clock: Clock::monotonic(),
            runtime_folder: PathBuf::from("/tmp"),
            travel_deg: 400.0,
            extras: true,
        }
    }
}
