//! The serial protocol: bytes in, events out. A state machine without I/O, without threads and
//! without its own clock; calls for which time matters take the time as an argument.
//!
//! It assembles lines, parses the messages of a Grbl 1.1 controller and of its relatives, keeps one line in flight and
//! matches its answer to it, requests status reports and brackets each with the times of request and
//! arrival, and distinguishes noise, merged lines and lost lines from success. If the controller
//! offers checked lines, each line carries a number and a checksum, and a lost one is sent again
//! without ever being executed twice.
//!
//! This module knows nothing of what the lines mean for the table.

mod checksum;
mod error_texts;
mod event;
mod lines;
mod machine;
mod message;
mod number;
mod pending;
mod polling;
mod status;

#[cfg(test)]
mod tests;

pub use event::{Counts, LineFault, LineOutcome, ProtocolEvent, SendError};
pub use machine::Machine;
pub use message::{Message, parse};
pub use pending::ReplyTimeout;
pub use status::{ControllerState, Pins, StatusReport};

/// Real-time commands: single bytes that the controller takes out of the stream anywhere; never part
/// of a line.
pub mod realtime {
    /// Requests a status report.
    pub const STATUS: u8 = b'?';
    /// Feed hold: the table ramps down, and a jog is discarded.
    pub const HOLD: u8 = b'!';
    /// Resets the controller. In motion, the steps stop at once and the position is lost.
    pub const RESET: u8 = 0x18;
}
