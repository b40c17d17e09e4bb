//! Requests for status reports, and which report answers which request.

use super::status::StatusReport;

/// Time after which an unanswered request counts as lost, microseconds.
const LOST_US: i64 = 120_000;
/// How long after that a report may still answer the lost request, microseconds.
const LATE_ANSWER_US: i64 = 500_000;

/// When to request a report, and which request is open.
#[derive(Debug, Default)]
pub(super) struct Polling {
    every_us: Option<i64>,
    /// When the last request was sent.
    last_us: Option<i64>,
    asked_us: Option<i64>,
    uncertain_until_us: Option<i64>,
}

impl Polling {
    /// Sets the interval of requests, microseconds; `None` for no requests.
    pub(super) fn set_every(&mut self, every_us: Option<i64>) {
        self.every_us = every_us;
    }

    /// Whether a request is due.
    pub(super) fn is_due(&mut self, now_us: i64) -> bool {
        let Some(every_us) = self.every_us else {
            return false;
        };
        if let Some(asked_us) = self.asked_us {
            if now_us - asked_us < LOST_US {
                return false;
            }
            self.uncertain_until_us = Some(now_us + LATE_ANSWER_US);
            self.asked_us = None;
        }
        self.last_us
            .is_none_or(|last_us| now_us - last_us >= every_us)
    }

    /// Notes that a request is sent now.
    pub(super) fn asked(&mut self, now_us: i64) {
        self.last_us = Some(now_us);
        self.asked_us = Some(now_us);
    }

    /// The report whose first byte arrived at `came_us`, with its times.
    pub(super) fn answered(&mut self, report: StatusReport, came_us: i64) -> StatusReport {
        let asked_us = self.asked_us.take_if(|asked_us| *asked_us <= came_us);
        let uncertain =
            asked_us.is_none_or(|asked| self.uncertain_until_us.is_some_and(|t| asked < t));
        StatusReport {
            asked_us,
            came_us,
            certain: !uncertain,
            ..report
        }
    }

    /// Notes that the controller has restarted and answers no earlier request.
    pub(super) fn forget(&mut self) {
        self.asked_us = None;
    }
}
