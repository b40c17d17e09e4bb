//! Asking for status reports, and which report answers which question.

use super::status::StatusReport;

/// How long a question may stay without a report before it counts as lost, microseconds.
const LOST_US: i64 = 120_000;
/// How long after a lost question a report may still be its answer, microseconds.
const DOUBT_US: i64 = 500_000;

/// A status report with its place in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Poll {
    /// What it says.
    pub report: StatusReport,
    /// When the question for it went out, microseconds; `None` for a report nobody asked for.
    pub asked_us: Option<i64>,
    /// When its first byte came, microseconds.
    pub came_us: i64,
    /// Whether it is certain that it answers that question and no earlier one.
    pub certain: bool,
}

/// When to ask, and what was asked.
#[derive(Debug, Default)]
pub(super) struct Polling {
    every_us: Option<i64>,
    /// When the last question was put, asked or not yet on its way.
    last_us: Option<i64>,
    asked_us: Option<i64>,
    doubt_until_us: Option<i64>,
}

impl Polling {
    /// Asks every so many microseconds from now on, or no more.
    pub(super) fn set_every(&mut self, every_us: Option<i64>) {
        self.every_us = every_us;
    }

    /// Whether a question is to go out now.
    pub(super) fn is_due(&mut self, now_us: i64) -> bool {
        let Some(every_us) = self.every_us else {
            return false;
        };
        if let Some(asked_us) = self.asked_us {
            if now_us - asked_us < LOST_US {
                return false;
            }
            self.doubt_until_us = Some(now_us + DOUBT_US);
            self.asked_us = None;
        }
        self.last_us
            .is_none_or(|last_us| now_us - last_us >= every_us)
    }

    /// A question goes out now.
    pub(super) fn asked(&mut self, now_us: i64) {
        self.last_us = Some(now_us);
        self.asked_us = Some(now_us);
    }

    /// A report has come whose first byte came at `came_us`.
    pub(super) fn answered(&mut self, report: StatusReport, came_us: i64) -> Poll {
        let asked_us = self.asked_us.take_if(|asked_us| *asked_us <= came_us);
        let doubtful = asked_us.is_none_or(|asked| self.doubt_until_us.is_some_and(|t| asked < t));
        Poll {
            report,
            asked_us,
            came_us,
            certain: !doubtful,
        }
    }

    /// The controller has restarted: questions before that are not answered any more.
    pub(super) fn forget(&mut self) {
        self.asked_us = None;
    }
}
