//! The turntable: a client of Grbl 1.1's serial interface that verifies everything.
//!
//! ```text
//! bytes <- port <- io_thread -> protocol (lines, answers) -> supervisor (state, stops)
//!                                        grbl_client, turn, plan, angle_fit -> angles over time
//! ```
//!
//! It works with a stock Grbl 1.1 board on which one millimetre of X is one degree, with Grbl's
//! relatives grblHAL, FluidNC and Grbl_ESP32, and with the rig's own firmware. Of the latter it uses the extras that `$I` offers: reports with the chip's
//! time, lines with number and checksum, and a lease that stops the table when the host falls
//! silent.
//!
//! A line counts as done only when its own answer has come, a motion only when the table was
//! reported at rest at its target. Anything else (a restart, an alarm, silence, a hold that this
//! program did not ask for, a table that stands still or in another place) ends the motion with
//! that reason and stops the table. A position that may be lost has to be homed again.
//!
//! ```
//! use relit_data::clock::Clock;
//! use relit_turntable::simulator::{SimulatedTable, SimulatorOptions};
//! use relit_turntable::{Table, TableOptions, TurnPlan};
//!
//! # fn main() -> Result<(), relit_turntable::TurntableError> {
//! let clock = Clock::virtual_time();
//! let _participant = clock.participate();
//! let simulated = SimulatedTable::new(&SimulatorOptions {
//!     clock: clock.clone(),
//!     ..SimulatorOptions::default()
//! });
//! let options = TableOptions {
//!     clock,
//!     ..TableOptions::default()
//! };
//! // A real one: `Table::open_serial(Path::new("/dev/ttyUSB0"), &options)`.
//! let table = Table::open(simulated.open(), &options)?;
//! table.home()?;
//! let plan = TurnPlan::new(table.identity(), &table.status()?, 7.2, 360.0)?;
//! let track = table.start_turn(plan)?.wait_end()?;
//! let (from_us, to_us) = track.constant_us();
//! assert!(track.angle_at(to_us) > track.angle_at(from_us));
//! # Ok(())
//! # }
//! ```
//!
//! A [`simulator`] replaces the table. This crate knows nothing of cameras and sessions. Its client
//! shares no code with the firmware, which the simulator runs: both sides implement the published interface.

mod address;
mod angle_fit;
mod codes;
mod error;
mod family;
mod grbl_client;
mod handshake;
mod homing;
mod identity;
mod io_thread;
mod plan;
mod port;
pub mod protocol;
pub mod simulator;
mod status;
mod supervisor;
#[cfg(test)]
mod tests;
mod turn;

use relit_data::clock::Clock;

pub use address::{SimulatedAddress, TurntableAddress, find_serial};
pub use angle_fit::AngleFit;
pub use codes::Alarm;
pub use error::TurntableError;
pub use family::Family;
pub use grbl_client::Table;
pub use homing::HomingResult;
pub use identity::Identity;
pub use plan::{MARGIN_DEG, TurnPlan};
pub use port::{Port, SerialPort, holder};
pub use protocol::{ControllerState, Counts, LineFault, SendError};
pub use status::TableStatus;
pub use supervisor::MotionFault;
pub use turn::{FinishedTurn, Turn};

/// How a table is opened.
#[derive(Debug, Clone, PartialEq)]
pub struct TableOptions {
    /// The clock of all waits and time stamps. A simulated table needs the clock of its simulator.
    pub clock: Clock,
    /// Whether to use what the rig's firmware offers beyond Grbl. If false, it is treated as a stock
    /// board.
    pub extras: bool,
}

impl Default for TableOptions {
    fn default() -> Self {
        Self {
            clock: Clock::monotonic(),
            extras: true,
        }
    }
}
