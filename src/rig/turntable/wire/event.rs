//! What the machine tells: events, and what becomes of a line.

use super::message::{Message, RestartCause};
use super::polling::Poll;

/// Something the controller did.
#[derive(Debug, PartialEq)]
pub enum WireEvent {
    /// The line `id` has its answer, or will never have one.
    Answered {
        /// What [`Machine::send`](super::Machine::send) gave.
        id: u64,
        /// What became of it.
        outcome: LineOutcome,
    },
    /// A status report.
    Status(Poll),
    /// The controller has restarted.
    Reset(Option<RestartCause>),
    /// An alarm, by its number.
    Alarm(u8),
}

/// What became of a line.
#[derive(Debug, Clone, PartialEq)]
pub enum LineOutcome {
    /// Accepted; with the lines that stood in front of the answer.
    Done(Vec<Message>),
    /// Refused with Grbl's number: it did nothing.
    Refused(u8),
    /// It has no answer and will have none: it may or may not have been executed.
    Failed(LineFault),
}

/// Why a line has no answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LineFault {
    /// Nothing that answers it came.
    #[error("no answer came to {tries} of it")]
    NoAnswer {
        /// How often it was sent.
        tries: u32,
    },
    /// The controller counts differently.
    #[error("the controller counts its lines differently")]
    OutOfOrder,
    /// The controller restarted.
    #[error("the controller restarted")]
    Restarted,
    /// It was given up, because the table is being stopped.
    #[error("it was given up to stop the table")]
    GivenUp,
}

/// Why a line was not sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum SendError {
    /// Another line waits for its answer.
    #[error("another line waits for its answer")]
    Busy,
    /// It is not known which answers are still to come; only a reset makes that certain again.
    #[error("answers are outstanding that cannot be told apart: stop the table first")]
    Unsure,
    /// The line cannot be sent as one.
    #[error("it is longer than 60 bytes or holds bytes that are no part of a line")]
    Unsendable,
}

/// What went wrong on the wire so far and was put right or noticed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Lines sent, without repetitions.
    pub lines: u64,
    /// TableStatus reports that came.
    pub reports: u64,
    /// Lines sent again.
    pub repeats: u64,
    /// Lines that came damaged or were nothing a controller says.
    pub noise: u64,
    /// Answers that nothing waited for.
    pub strays: u64,
}
