//! How far all recordings of a run have come, and when they are done.

use std::time::{Duration, Instant};

use super::{Console, Event, format_duration};

/// Counts the recordings of a run, and the time that the work on one takes.
#[derive(Debug)]
pub struct RunTotals {
    /// How many there are.
    pub of: u64,
    /// How many are done.
    pub done: u64,
    worked_on: u32,
    /// The time of those that were worked on.
    worked: Duration,
    /// When the last recording ended.
    since: Instant,
}

/// Shorter than this, the time left is not told in minutes.
const SHORT: Duration = Duration::from_secs(60);

impl RunTotals {
    /// Of so many recordings none is done, and the first begins now.
    pub fn new(of: u64, now: Instant) -> Self {
        Self {
            of,
            done: 0,
            worked_on: 0,
            worked: Duration::ZERO,
            since: now,
        }
    }

    /// A recording ended; those that are skipped or fail are not worked on, and take hardly any time.
    pub fn ended(&mut self, was_worked_on: bool, now: Instant) {
        self.done += 1;
        if was_worked_on {
            self.worked_on += 1;
            self.worked += now.saturating_duration_since(self.since);
        }
        self.since = now;
    }

    /// The time until all are done, if each takes as long as those so far. Not known before one was worked on.
    pub fn left(&self) -> Option<Duration> {
        let waiting = u32::try_from(self.of.saturating_sub(self.done)).ok()?;
        let mean = self.worked.checked_div(self.worked_on)?;
        mean.checked_mul(waiting)
    }

    /// Says the progress of all, where there are several.
    pub fn say(&self, console: Console) {
        let Self { of, done, .. } = *self;
        if of < 2 {
            return;
        }
        let left = self.left();
        let until = match left {
            Some(left) if done < of && left < SHORT => ", less than a minute left".to_owned(),
            Some(left) if done < of => format!(", about {} left", format_duration(left)),
            _ => String::new(),
        };
        console.print_phase(
            &format!("{done} of {of} done{until}"),
            &Event::Total {
                done,
                of,
                seconds_left: left.map(|left| left.as_secs()),
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_takes_as_long_as_what_was_worked_on() {
        let start = Instant::now();
        let after = |seconds| start + Duration::from_secs(seconds);
        let mut totals = RunTotals::new(10, start);
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
