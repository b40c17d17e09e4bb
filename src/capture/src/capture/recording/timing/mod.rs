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
mod missing_frames;
mod numbering;
mod period_fit;

pub(crate) use anomaly::TimingAnomaly;
use line::FARTHEST;
pub(crate) use missing_frames::{MissingFrames, gaps};
use numbering::Numbering;

/// Largest relative difference between the camera's rate and the agreed one.
const RATE_TOLERANCE: f64 = 0.02;

/// Counter and time stamp of one delivered frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct FrameStamp {
    /// The driver's counter without its wraps; `None` if the camera has none. It may stand still
    /// or go back.
    pub sequence: Option<u64>,
    /// The time stamp, microseconds.
    pub t_us: i64,
}

/// What the stamps of a row of frames show.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FrameTiming {
    /// The time between exposures, microseconds.
    pub period_us: f64,
    /// When exposure 0 is due by the straight line through all stamps, microseconds.
    pub start_us: f64,
    /// Whether the driver's counter numbers the exposures: there is one, and it does not stand still.
    pub counts: bool,
    /// For each delivered frame the number of its exposure; the first is 0, and they grow.
    pub exposures: Vec<u64>,
    /// What does not fit.
    pub anomalies: Vec<TimingAnomaly>,
}

impl FrameTiming {
    /// Analyses the stamps of frames in the order of their delivery. `fps`: the agreed rate,
    /// frames a second; one that is not positive counts as 30.
    pub(crate) fn from_stamps(stamps: &[FrameStamp], fps: f64) -> Self {
        let usable = fps.is_finite() && fps > 0.0;
        let fps = if usable { fps } else { 30.0 };
        let nominal = 1e6 / fps;
        // Times since the first: their differences are exact in a float.
        let first = stamps.first().map_or(0, |stamp| stamp.t_us);
        let times: Vec<f64> = stamps
            .iter()
            .map(|stamp| stamp.t_us.saturating_sub(first) as f64)
            .collect();
        let counts = counts(stamps);
        let mut found = if counts {
            Numbering::by_both(&counted(stamps), &times, nominal)
        } else {
            Numbering::by_time(&times, nominal)
        };
        found.anomalies.extend(wrong_rates(&found, fps));
        Self {
            period_us: found.line.period,
            start_us: first as f64 + found.line.start,
            counts,
            exposures: found.exposures,
            anomalies: found.anomalies,
        }
    }
}

/// Whether the counter counts. One that repeats a number now and then still does.
fn counts(stamps: &[FrameStamp]) -> bool {
    let steps = stamps.windows(2);
    let grown = steps.filter(|pair| pair[1].sequence > pair[0].sequence);
    stamps.iter().all(|stamp| stamp.sequence.is_some())
        && grown.count() * 2 >= stamps.len().saturating_sub(1)
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

#[cfg(test)]
mod tests;
