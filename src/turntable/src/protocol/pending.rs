//! The one line in flight.

use super::message::Message;

/// How many times a checked line is sent before it counts as lost.
pub(super) const TRIES: u32 = 5;
/// Time limit for the answer to a line that is answered at once, microseconds.
const ANSWER_US: i64 = 500_000;
/// Shortest time after which an error for a damaged line can refer to the line in flight,
/// microseconds: an earlier one refers to something sent before it.
const TURNAROUND_US: i64 = 5_000;
/// Limit of messages kept that stand before an answer: grblHAL has more than 200 settings.
const MAX_MESSAGES: usize = 512;

/// The time limit for a line's answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReplyTimeout {
    /// It is answered at once.
    AtOnce,
    /// It is answered within so many microseconds, when what it asks for has happened.
    Within(i64),
}

/// What has to be done with a line.
#[derive(Debug, PartialEq)]
pub(super) enum PendingAction {
    /// Nothing yet.
    Wait,
    /// Send it again.
    Again,
    /// It has failed.
    Lost,
}

/// A line that waits for its answer.
#[derive(Debug)]
pub(super) struct Pending {
    pub(super) id: u64,
    pub(super) bytes: Vec<u8>,
    /// The checked line's number; `None` for a plain line.
    pub(super) seq: Option<u32>,
    pub(super) tries: u32,
    /// Messages since it was sent that are not answers.
    pub(super) info: Vec<Message>,
    timeout: ReplyTimeout,
    first_us: i64,
    last_us: i64,
}

impl Pending {
    pub(super) fn new(
        id: u64,
        text: &str,
        seq: Option<u32>,
        timeout: ReplyTimeout,
        now_us: i64,
    ) -> Self {
        Self {
            id,
            bytes: format!("{text}\n").into_bytes(),
            seq,
            tries: 1,
            info: Vec::new(),
            timeout,
            first_us: now_us,
            last_us: now_us,
        }
    }

    /// What has to be done with a line that has no answer yet.
    pub(super) fn next_action(&self, now_us: i64) -> PendingAction {
        let waited_us = now_us - self.last_us;
        let over = match self.timeout {
            ReplyTimeout::AtOnce => {
                waited_us >= ANSWER_US && (self.seq.is_none() || self.tries >= TRIES)
            }
            ReplyTimeout::Within(limit_us) => now_us - self.first_us >= limit_us,
        };
        // A line whose answer takes long is repeated at growing intervals: the controller may not
        // read it for a while, and its buffer is small.
        let again_us = match self.timeout {
            ReplyTimeout::AtOnce => ANSWER_US,
            ReplyTimeout::Within(_) => ANSWER_US << self.tries.min(TRIES),
        };
        if over {
            PendingAction::Lost
        } else if self.seq.is_some() && self.tries < TRIES && waited_us >= again_us {
            PendingAction::Again
        } else {
            PendingAction::Wait
        }
    }

    /// What has to be done with this line after the controller's error for a damaged line.
    pub(super) fn damaged(&self, now_us: i64) -> PendingAction {
        if now_us - self.last_us < TURNAROUND_US || self.seq.is_none() {
            PendingAction::Wait
        } else if self.tries >= TRIES {
            PendingAction::Lost
        } else {
            PendingAction::Again
        }
    }

    /// Notes that it was sent again.
    pub(super) fn sent_again(&mut self, now_us: i64) {
        self.tries += 1;
        self.last_us = now_us;
    }

    /// Keeps a message that stands before the answer. An answer of many lines takes a while: the wait
    /// for the end of a plain line's answer begins again.
    pub(super) fn keep(&mut self, now_us: i64, message: Message) {
        if self.info.len() < MAX_MESSAGES {
            self.info.push(message);
            if self.seq.is_none() {
                self.last_us = now_us;
            }
        }
    }
}
