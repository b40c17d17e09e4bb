//! The events of the protocol's state machine, and the outcomes of lines.

use super::message::Message;
use super::status::StatusReport;

/// An event from the controller.
#[derive(Debug, PartialEq)]
pub enum ProtocolEvent {
    /// The line `id` has been answered or has failed.
    Answered {
        /// The id that [`Machine::send`](super::Machine::send) returned.
        id: u64,
        /// The line's outcome.
        outcome: LineOutcome,
    },
    /// A status report.
    Status(StatusReport),
    /// The controller has restarted; why, if it says so.
    Reset(Option<String>),
    /// An alarm with its number.
    Alarm(u8),
}

/// The outcome of a line.
#[derive(Debug, Clone, PartialEq)]
pub enum LineOutcome {
    /// Accepted; with the messages before the answer.
    Done(Vec<Message>),
    /// Refused with Grbl's error number; not executed.
    Refused(u8),
    /// Not answered: it may or may not have been executed.
    Failed(LineFault),
}

/// Why a line was not answered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum LineFault {
    /// No answer came.
    #[error("no answer came to {tries} of it")]
    NoAnswer {
        /// How many times it was sent.
        tries: u32,
    },
    /// The controller expects another line number.
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
    /// Answers to earlier lines may still arrive; only a reset makes the state certain again.
    #[error("answers are outstanding that cannot be distinguished: stop the table first")]
    Unsure,
    /// The text cannot be sent as one line.
    #[error("it is longer than 60 bytes or holds bytes that a line cannot have")]
    Unsendable,
}

/// Counters of lines, reports and line errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Counts {
    /// Lines sent, without repetitions.
    pub lines: u64,
    /// Status reports received.
    pub reports: u64,
    /// Messages received while no line waited for its answer, such as those of a start.
    pub messages: u64,
    /// Lines sent again.
    pub repeats: u64,
    /// Lines received damaged, or that no controller sends.
    pub noise: u64,
    /// Answers for which no line was waiting.
    pub strays: u64,
}
