//! How far all recordings of a run have come, and when they are done.

use std::time::{Duration, Instant};

/// Counts recordings and the time that extracting takes.
#[derive(Debug)]
pub(super) struct RunTotals {
    pub(super) of: u64,
    pub(super) done: u64,
    extracted: u32,
    /// The time of those that were extracted.
    worked: Duration,
    /// When the last recording ended.
    since: Instant,
}

impl RunTotals {
    pub(super) fn new(now: Instant) -> Self {
        Self {
            of: 0,
            done: 0,
            extracted: 0,
            worked: Duration::ZERO,
            since: now,
        }
    }

    /// A recording ended; those that are not extracted take hardly any time.
    pub(super) fn ended(&mut self, was_extracted: bool, now: Instant) {
        self.done += 1;
        if was_extracted {
            self.extracted += 1;
            self.worked += now.saturating_duration_since(self.since);
        }
        self.since = now;
    }

    /// The time until all are done, if each takes as long as those so far. Not known before one is extracted.
    pub(super) fn left(&self) -> Option<Duration> {
        let waiting = u32::try_from(self.of.saturating_sub(self.done)).ok()?;
        let mean = self.worked.checked_div(self.extracted)?;
        mean.checked_mul(waiting)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_takes_as_long_as_what_was_extracted() {
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs(seconds);
        let mut totals = RunTotals::new(start);
        totals.of = 10;
        assert_eq!(totals.left(), None);
        // Skipped recordings say nothing of those that follow.
        totals.ended(false, after(1));
        assert_eq!(totals.left(), None);
        totals.ended(true, after(21));
        totals.ended(false, after(22));
        totals.ended(true, after(62));
        assert_eq!(totals.left(), Some(Duration::from_secs(6 * 30)));
        for _ in 0..6 {
            totals.ended(true, after(62));
        }
        assert_eq!((totals.done, totals.left()), (10, Some(Duration::ZERO)));
    }
}
