//! Which frames a camera did not deliver, by the driver's counter and the time stamps. A pure
//! function over both.
//!
//! A camera exposes at a constant rate: exposure `s` is stamped `a + p s`, give or take up to 40 %
//! of the period `p`. Where the counter counts, it numbers the exposures, and a straight line
//! through the stamps confirms it. Where it does not (some drivers repeat numbers, or never count),
//! or where line and stamps differ, `p` and `a` are found from the stamps alone (`period_fit.rs`).
//!
//! Where both disagree for good, the stamps decide what is missing, since a frame's angle follows
//! from its time, and the contradiction is reported.

mod anomaly;
mod line;
mod numbering;
mod period_fit;

pub(crate) use anomaly::TimingAnomaly;
use line::FARTHEST;
use numbering::Numbering;

/// Largest relative difference between the camera's rate and the agreed one.
const RATE_TOLERANCE: f64 = 0.02;

/// Counter and time stamp of one delivered frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FrameStamp {
    /// The driver's counter without its wraps; `None` where the camera has none. It may stand still
    /// or go back.
    pub sequence: Option<u64>,
    /// The time stamp, microseconds.
    pub t_us: i64,
}

/// What shows that frames are missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Evidence {
    /// Counter and time stamps.
    Both,
    /// The counter; the time stamps are too irregular.
    Counter,
    /// The time stamps; the counter stands still or the camera has none.
    Time,
    /// The time stamps, against the counter: see [`TimingAnomaly::Contradiction`].
    TimeAgainstCounter,
}

/// Frames that were exposed and not delivered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct MissingFrames {
    /// The first missing exposure, counted from that of the first delivered frame, which is 0.
    pub exposure: u64,
    /// How many in a row.
    pub count: u64,
    /// The delivered frame that comes after them, from 0.
    pub before: usize,
    /// What shows it.
    pub evidence: Evidence,
}

/// What the driver's counter does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Counter {
    /// It counts exposures.
    Counts,
    /// It stands still.
    Still,
    /// The camera has none.
    Absent,
}

/// What the stamps of a row of frames show.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameTiming {
    /// The time between exposures, microseconds.
    pub period_us: f64,
    /// When exposure 0 is due by the straight line through all stamps, microseconds.
    pub start_us: f64,
    /// What the counter does.
    pub counter: Counter,
    /// For each delivered frame the number of its exposure; the first is 0, and they grow.
    pub exposures: Vec<u64>,
    /// What is missing between delivered frames, in order.
    pub missing: Vec<MissingFrames>,
    /// What does not fit.
    pub anomalies: Vec<TimingAnomaly>,
}

impl FrameTiming {
    /// Analyses the stamps of frames in the order of their delivery. `fps`: the agreed rate,
    /// frames a second; one that is not positive counts as 30.
    pub(crate) fn of(stamps: &[FrameStamp], fps: f64) -> Self {
        let usable = fps.is_finite() && fps > 0.0;
        let fps = if usable { fps } else { 30.0 };
        let nominal = 1e6 / fps;
        // Times since the first: their differences are exact in a float.
        let first = stamps.first().map_or(0, |stamp| stamp.t_us);
        let times: Vec<f64> = stamps
            .iter()
            .map(|stamp| stamp.t_us.saturating_sub(first) as f64)
            .collect();
        let counter = counter_of(stamps);
        let mut found = match counter {
            Counter::Counts => Numbering::by_both(&counted(stamps), &times, nominal),
            Counter::Still | Counter::Absent => Numbering::by_time(&times, nominal),
        };
        found.anomalies.extend(wrong_rates(&found, fps));
        Self {
            period_us: found.line.period,
            start_us: first as f64 + found.line.start,
            counter,
            missing: missing(&found, counter),
            exposures: found.exposures,
            anomalies: found.anomalies,
        }
    }
}

/// Whether the counter counts. One that repeats a number now and then still does.
fn counter_of(stamps: &[FrameStamp]) -> Counter {
    if stamps.iter().any(|stamp| stamp.sequence.is_none()) {
        return Counter::Absent;
    }
    let steps = stamps.windows(2);
    let grown = steps.filter(|pair| pair[1].sequence > pair[0].sequence);
    match grown.count() * 2 < stamps.len().saturating_sub(1) {
        true => Counter::Still,
        false => Counter::Counts,
    }
}

/// The counter from the first frame on; it may go back below 0.
fn counted(stamps: &[FrameStamp]) -> Vec<i64> {
    let sequence = |stamp: &FrameStamp| stamp.sequence.unwrap_or(0);
    let first = stamps.first().map_or(0, sequence);
    let since_first = |stamp| sequence(stamp).wrapping_sub(first).cast_signed();
    let stamps = stamps.iter();
    stamps
        .map(|stamp| since_first(stamp).clamp(-FARTHEST, FARTHEST))
        .collect()
}

/// Rates that are not the agreed one: that of the exposures, and that of the frames, as a camera
/// at half the rate seems to lose every second frame.
fn wrong_rates(found: &Numbering, agreed: f64) -> Vec<TimingAnomaly> {
    let exposed = 1e6 / found.line.period;
    let mut steps: Vec<u64> = found.exposures.windows(2).map(|p| p[1] - p[0]).collect();
    steps.sort_unstable();
    let median = steps.get(steps.len() / 2).filter(|&&median| median > 1);
    let differs = (exposed / agreed - 1.0).abs() > RATE_TOLERANCE;
    let rates = differs.then_some(exposed).into_iter();
    rates
        .chain(median.map(|&median| exposed / median as f64))
        .map(|measured| TimingAnomaly::Rate { measured, agreed })
        .collect()
}

fn missing(found: &Numbering, counter: Counter) -> Vec<MissingFrames> {
    let steps = found.exposures.windows(2).zip(1_usize..);
    steps
        .filter_map(|(pair, before)| {
            let count = pair[1].saturating_sub(pair[0]).saturating_sub(1);
            let evidence = match (counter, found.by_time, found.agreed.get(before)) {
                (Counter::Still | Counter::Absent, ..) => Evidence::Time,
                (Counter::Counts, false, _) => Evidence::Counter,
                (Counter::Counts, true, Some(false)) => Evidence::TimeAgainstCounter,
                (Counter::Counts, true, _) => Evidence::Both,
            };
            (count > 0).then_some(MissingFrames {
                exposure: pair[0] + 1,
                count,
                before,
                evidence,
            })
        })
        .collect()
}

#[cfg(test)]
mod tests;
