//! The one line in flight.

use super::message::Message;

/// How often a checked line is sent before it counts as lost for good.
pub(super) const TRIES: u32 = 5;
/// How long a line that is answered at once may stay without answer, microseconds.
const ANSWER_US: i64 = 500_000;
/// How soon after it was sent a line may be sent again because it came damaged, microseconds: a
/// complaint that comes sooner is about something before it.
const TURNAROUND_US: i64 = 5_000;
/// Most lines kept that stand in front of an answer.
const MOST_INFO: usize = 128;

/// How long a line's answer may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReplyTimeout {
    /// It is answered at once.
    AtOnce,
    /// It is answered after something else has happened, within so many microseconds.
    Within(i64),
}

/// What has become of a line.
#[derive(Debug, PartialEq)]
pub(super) enum Due {
    /// Nothing is to be done yet.
    Wait,
    /// It is to be sent again.
    Again,
    /// It has failed for good.
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
    /// What came since it was sent and is no answer.
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

    /// What is to be done with a line that has no answer yet.
    pub(super) fn due(&self, now_us: i64) -> Due {
        let waited_us = now_us - self.last_us;
        let over = match self.timeout {
            ReplyTimeout::AtOnce => {
                waited_us >= ANSWER_US && (self.seq.is_none() || self.tries >= TRIES)
            }
            ReplyTimeout::Within(limit_us) => now_us - self.first_us >= limit_us,
        };
        // A line whose answer takes long is asked after at growing distances: the controller may
        // be unable to read it, and its buffer is small.
        let again_us = match self.timeout {
            ReplyTimeout::AtOnce => ANSWER_US,
            ReplyTimeout::Within(_) => ANSWER_US << self.tries.min(TRIES),
        };
        if over {
            Due::Lost
        } else if self.seq.is_some() && self.tries < TRIES && waited_us >= again_us {
            Due::Again
        } else {
            Due::Wait
        }
    }

    /// The controller complains of a damaged line: what that means for this one.
    pub(super) fn damaged(&self, now_us: i64) -> Due {
        if now_us - self.last_us < TURNAROUND_US || self.seq.is_none() {
            Due::Wait
        } else if self.tries >= TRIES {
            Due::Lost
        } else {
            Due::Again
        }
    }

    /// Counts one more sending.
    pub(super) fn sent_again(&mut self, now_us: i64) {
        self.tries += 1;
        self.last_us = now_us;
    }

    pub(super) fn keep(&mut self, message: Message) {
        if self.info.len() < MOST_INFO {
            self.info.push(message);
        }
    }
}
