//! The wire: bytes in, events out. A state machine without I/O, without threads and without a
//! clock of its own; every call that time matters to is told the time.
//!
//! It puts lines together, parses what a Grbl 1.1 controller says, keeps one line in flight and
//! matches its answer one to one, asks for status reports and brackets them with the time of
//! question and answer, and tells noise, merged and lost lines from success. Where the controller
//! offers checked lines, each line carries a number and a checksum, and a lost one is sent again
//! without ever being executed twice.
//!
//! It knows nothing of what the lines mean for the table.

mod checksum;
mod event;
mod lines;
mod machine;
mod message;
mod number;
mod pending;
mod polling;
mod status;

#[cfg(test)]
mod properties;
#[cfg(test)]
mod tests;

pub use event::{Counts, LineFault, LineOutcome, SendError, WireEvent};
pub use machine::Machine;
pub use message::{Banner, Message, RestartCause, parse};
pub use pending::ReplyTimeout;
pub use polling::Poll;
pub use status::{ControllerState, Pins, Position, StatusReport};

/// Real-time bytes: taken by the controller from anywhere in the stream, never part of a line.
pub mod realtime {
    /// Asks for a status report.
    pub const STATUS: u8 = b'?';
    /// Feed hold: the table ramps down, and a jog is dropped.
    pub const HOLD: u8 = b'!';
    /// Resets the controller: in motion the steps stop at once and the position is lost.
    pub const RESET: u8 = 0x18;
}
