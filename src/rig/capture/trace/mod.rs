//! Which frames are missing in what a camera delivered, told from two witnesses: the driver's
//! counter and the time stamps. A pure function over both.
//!
//! A camera exposes at a constant rate: exposure `s` is stamped `a + p s`, give or take up to 40 %
//! of the period `p`. Where the counter counts, it numbers the exposures, and a straight line
//! through the stamps confirms it. Where it does not (some drivers repeat numbers, or never count),
//! or where line and stamps part, `p` and `a` are found from the stamps alone (`comb.rs`).
//!
//! Where both witnesses disagree for good, the stamps decide what is missing, since a frame's angle
//! follows from its time, and the contradiction is told.

mod comb;
mod witness;

use witness::{by_both, by_time};

/// How far the rate may be off from what was agreed, as a part of it.
const RATE_TOLERANCE: f64 = 0.02;

/// Exposures from the first one on beyond which no number is believed: sums of them stay exact.
const FARTHEST: i64 = 1 << 50;

/// What is known of one delivered frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stamp {
    /// The driver's counter without its wraps; `None` where the camera has none. It may stand, or
    /// go back.
    pub sequence: Option<u64>,
    /// The time stamp, microseconds.
    pub t_us: i64,
}

/// Who saw that frames are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Witness {
    /// Counter and time stamps.
    Both,
    /// The counter; the time stamps are too irregular to tell.
    Counter,
    /// The time stamps; the counter stands or the camera has none.
    Time,
    /// The time stamps, against the counter: see [`Doubt::Contradiction`].
    TimeAgainstCounter,
}

/// Frames that were exposed and not delivered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Missing {
    /// The first missing exposure, counted from that of the first delivered frame, which is 0.
    pub exposure: u64,
    /// How many in a row.
    pub count: u64,
    /// Which delivered frame comes after them, from 0.
    pub before: usize,
    /// Who saw it.
    pub seen_by: Witness,
}

/// What the counter is good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Counter {
    /// It counts exposures.
    Counts,
    /// It stands still.
    Still,
    /// The camera has none.
    Absent,
}

/// Something that does not fit, though frames need not be missing.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum Doubt {
    /// Counter and time stamps disagree on what lies between two frames.
    #[error(
        "before frame {before} the driver's counter grows by {counted} and the time stamps by {timed} frames"
    )]
    Contradiction {
        /// The frame after the place.
        before: usize,
        /// By how much the counter grew.
        counted: i64,
        /// By how many periods the time grew.
        timed: i64,
    },
    /// A stamp that is off by a period or more, and its neighbours are not.
    #[error("the time stamp of frame {frame} is off by {off} frames")]
    OddTime {
        /// The frame.
        frame: usize,
        /// By how many periods, late ones positive.
        off: i64,
    },
    /// Two frames in one period, without a counter that tells them apart.
    #[error("frame {frame} comes within the same period as the one before")]
    SamePeriod {
        /// The second of both.
        frame: usize,
    },
    /// The time stamps tell nothing.
    #[error("the time stamps are too irregular to count frames by")]
    Irregular,
    /// The camera does not keep the rate.
    #[error("the camera delivers {measured:.2} frames/s where {agreed:.2} were agreed")]
    Rate {
        /// Frames a second as found.
        measured: f64,
        /// Frames a second as agreed.
        agreed: f64,
    },
}

/// What a row of stamps tells.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// The time between exposures, microseconds.
    pub period_us: f64,
    /// When exposure 0 is due by the straight line through all stamps, microseconds.
    pub start_us: f64,
    /// What the counter is good for.
    pub counter: Counter,
    /// For each delivered frame the number of its exposure; the first is 0, and they grow.
    pub exposures: Vec<u64>,
    /// What is missing between delivered frames, in order.
    pub missing: Vec<Missing>,
    /// What does not fit.
    pub doubts: Vec<Doubt>,
}

impl Trace {
    /// Looks through the stamps of frames in the order of their delivery. `fps`: the agreed rate,
    /// frames a second; one that is not positive counts as 30.
    #[must_use]
    pub fn of(stamps: &[Stamp], fps: f64) -> Self {
        let fps = if fps.is_finite() && fps > 0.0 {
            fps
        } else {
            30.0
        };
        let nominal = 1e6 / fps;
        // Times from the first on: their differences are exact in a float.
        let first = stamps.first().map_or(0, |stamp| stamp.t_us);
        let times: Vec<f64> = stamps
            .iter()
            .map(|stamp| stamp.t_us.saturating_sub(first) as f64)
            .collect();
        let counter = judge(stamps);
        let mut found = match counter {
            Counter::Counts => by_both(&counted(stamps), &times, nominal),
            Counter::Still | Counter::Absent => by_time(&times, nominal),
        };
        found.check_rate(fps);
        found.check_median_step(fps);
        Self {
            period_us: found.line.period,
            start_us: first as f64 + found.line.start,
            counter,
            missing: found.missing(counter),
            exposures: found.exposures,
            doubts: found.doubts,
        }
    }

    /// How many exposures were not delivered between the first and the last delivered frame.
    #[must_use]
    pub fn missing_count(&self) -> u64 {
        self.missing.iter().map(|missing| missing.count).sum()
    }
}

/// Whether the counter counts. One that repeats a number now and then still does.
fn judge(stamps: &[Stamp]) -> Counter {
    if stamps.iter().any(|stamp| stamp.sequence.is_none()) {
        return Counter::Absent;
    }
    let steps = stamps.len().saturating_sub(1);
    let grown = stamps
        .windows(2)
        .filter(|pair| pair[1].sequence > pair[0].sequence)
        .count();
    if steps > 0 && grown * 2 < steps {
        Counter::Still
    } else {
        Counter::Counts
    }
}

/// The counter from the first frame on; it may go back below 0.
fn counted(stamps: &[Stamp]) -> Vec<i64> {
    let first = stamps.first().and_then(|stamp| stamp.sequence).unwrap_or(0);
    let from_first = |stamp: &Stamp| {
        let sequence = stamp.sequence.unwrap_or(0);
        sequence
            .wrapping_sub(first)
            .cast_signed()
            .clamp(-FARTHEST, FARTHEST)
    };
    stamps.iter().map(from_first).collect()
}

/// A straight line: exposure `s` is due at `start + period * s`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Line {
    start: f64,
    period: f64,
}

impl Line {
    /// The line of least squares; `None` where the numbers do not differ, or the line falls.
    fn through(numbers: &[i64], times: &[f64]) -> Option<Self> {
        let count = numbers.len() as f64;
        let mean = |sum: f64| sum / count;
        let middle = mean(numbers.iter().map(|&n| n as f64).sum());
        let mean_time = mean(times.iter().sum());
        let (mut product, mut square) = (0.0, 0.0);
        for (&number, &time) in numbers.iter().zip(times) {
            let off = number as f64 - middle;
            product += off * (time - mean_time);
            square += off * off;
        }
        let period = product / square;
        (period.is_finite() && period > 0.0).then_some(Self {
            start: mean_time - period * middle,
            period,
        })
    }

    /// How far a time is from the place of an exposure, periods.
    fn off(self, number: i64, time: f64) -> f64 {
        (time - self.start) / self.period - number as f64
    }

    fn nearest(self, time: f64) -> i64 {
        let number = ((time - self.start) / self.period).round();
        number.clamp(-FARTHEST as f64, FARTHEST as f64) as i64
    }
}

/// What was found, before it is told.
struct Found {
    line: Line,
    exposures: Vec<u64>,
    /// For each frame, whether both witnesses agree on what lies before it; empty where there is
    /// one witness only.
    agreed: Vec<bool>,
    /// False where the stamps are too irregular.
    by_time: bool,
    doubts: Vec<Doubt>,
}

impl Found {
    fn missing(&self, counter: Counter) -> Vec<Missing> {
        let steps = self.exposures.windows(2).zip(1_usize..);
        steps
            .filter_map(|(pair, before)| {
                let count = pair[1].saturating_sub(pair[0]).saturating_sub(1);
                let seen_by = match (counter, self.by_time, self.agreed.get(before)) {
                    (Counter::Still | Counter::Absent, ..) => Witness::Time,
                    (Counter::Counts, false, _) => Witness::Counter,
                    (Counter::Counts, true, Some(false)) => Witness::TimeAgainstCounter,
                    (Counter::Counts, true, _) => Witness::Both,
                };
                (count > 0).then_some(Missing {
                    exposure: pair[0] + 1,
                    count,
                    before,
                    seen_by,
                })
            })
            .collect()
    }

    fn check_rate(&mut self, agreed: f64) {
        let measured = 1e6 / self.line.period;
        if (measured / agreed - 1.0).abs() > RATE_TOLERANCE {
            self.doubts.push(Doubt::Rate { measured, agreed });
        }
    }

    /// A camera at half the rate seems to lose every second frame.
    fn check_median_step(&mut self, agreed: f64) {
        let mut steps: Vec<u64> = self.exposures.windows(2).map(|p| p[1] - p[0]).collect();
        steps.sort_unstable();
        if let Some(&median) = steps.get(steps.len() / 2)
            && median > 1
        {
            let measured = 1e6 / self.line.period / median as f64;
            self.doubts.push(Doubt::Rate { measured, agreed });
        }
    }
}

/// Numbers from the first on, as exposures.
fn from_first(numbers: &[i64]) -> Vec<u64> {
    let first = numbers.first().copied().unwrap_or(0);
    numbers
        .iter()
        .map(|&number| number.saturating_sub(first).max(0).cast_unsigned())
        .collect()
}

/// The same, made to grow where they stand or go back.
fn strictly(numbers: &[i64]) -> Vec<u64> {
    let mut exposures = from_first(numbers);
    for at in 1..exposures.len() {
        exposures[at] = exposures[at].max(exposures[at - 1].saturating_add(1));
    }
    exposures
}

#[cfg(test)]
mod tests;
