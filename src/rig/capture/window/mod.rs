//! Cutting the frames of a turn out of a camera's stream.
//!
//! When the turn begins is often known only after it began: the table's motion is fitted first. So
//! the frames of the last seconds wait in a ring. Frames near the turn's end wait until the camera's
//! true rate is known from all of them, since it decides how many exposures the turn has.

use std::collections::VecDeque;
use std::sync::Arc;

use super::trace::{Doubt, Missing, Stamp, Trace, Witness};
use crate::camera::Frame;

/// How long a frame waits for a turn to be announced, microseconds.
const RING_US: i64 = 4_000_000;
/// Most bytes that wait.
const RING_BYTES: usize = 96 << 20;
/// Frames from which on the measured rate is believed more than the agreed one.
const FEWEST_FOR_RATE: usize = 30;

/// The time of a turn: from the first instant up to, but not with, the last; microseconds of the
/// clock that stamps the frames.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    from_us: i64,
    to_us: i64,
}

impl Window {
    /// `None` where it does not end after it begins.
    #[must_use]
    pub fn new(from_us: i64, to_us: i64) -> Option<Self> {
        (from_us < to_us).then_some(Self { from_us, to_us })
    }

    /// The time of so many microseconds from `from_us` on; of one at least.
    #[must_use]
    pub fn lasting(from_us: i64, us: i64) -> Self {
        let from_us = from_us.min(i64::MAX - 1);
        Self {
            from_us,
            to_us: from_us.saturating_add(us.max(1)),
        }
    }

    /// When it begins, microseconds.
    #[must_use]
    pub fn from_us(self) -> i64 {
        self.from_us
    }

    /// When it is over, microseconds.
    #[must_use]
    pub fn to_us(self) -> i64 {
        self.to_us
    }
}

/// A frame that is to be recorded.
#[derive(Debug, Clone)]
pub(super) struct Chosen {
    pub(super) frame: Arc<Frame>,
    /// Its place among the delivered frames of the turn; `None` for those before it, which a
    /// decoder needs.
    pub(super) delivered: Option<usize>,
}

/// What a turn should have, and what the camera delivered of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Count {
    /// Exposures of the turn, by the camera's own rate.
    pub expected: u64,
    /// For each delivered frame of the turn, which exposure it is, from 0.
    pub exposures: Vec<u64>,
    /// What the camera did not deliver: exposures of the turn, before which delivered frame.
    pub missing: Vec<Missing>,
    /// What does not fit.
    pub doubts: Vec<Doubt>,
    /// True where the driver's counter numbers the exposures.
    pub counts: bool,
}

impl Count {
    /// How many exposures the camera did not deliver.
    #[must_use]
    pub fn missing_count(&self) -> u64 {
        self.missing.iter().map(|missing| missing.count).sum()
    }
}

/// Chooses the frames of one turn, in the order of their delivery.
pub(super) struct Cutter {
    fps: f64,
    /// Where frames build on each other: from which one decoding can begin.
    begins_chain: Option<fn(&[u8]) -> bool>,
    window: Option<Window>,
    ring: VecDeque<Arc<Frame>>,
    ring_bytes: usize,
    /// Frames in the ring with which a chain begins.
    keys: usize,
    /// The last frame before those of the turn that are recorded.
    before: Option<Stamp>,
    /// The last frame for which there was no place in the ring.
    dropped: Option<Stamp>,
    stamps: Vec<Stamp>,
    held: VecDeque<Chosen>,
    done: bool,
}

impl Cutter {
    pub(super) fn new(fps: f64, begins_chain: Option<fn(&[u8]) -> bool>) -> Self {
        Self {
            fps,
            begins_chain,
            window: None,
            ring: VecDeque::new(),
            ring_bytes: 0,
            keys: 0,
            before: None,
            dropped: None,
            stamps: Vec::new(),
            held: VecDeque::new(),
            done: false,
        }
    }

    /// Says when the turn is, once; answers what is to be recorded of the frames that wait.
    pub(super) fn announce(&mut self, window: Window) -> Vec<Chosen> {
        if self.window.is_some() {
            return Vec::new();
        }
        self.window = Some(window);
        (self.ring_bytes, self.keys) = (0, 0);
        self.before = self.dropped;
        let waiting = std::mem::take(&mut self.ring);
        waiting
            .into_iter()
            .flat_map(|frame| self.push(frame))
            .collect()
    }

    /// True once the window was announced.
    pub(super) fn knows_window(&self) -> bool {
        self.window.is_some()
    }

    /// True once a frame came after the turn.
    pub(super) fn is_done(&self) -> bool {
        self.done
    }

    /// True once a frame of the turn came.
    pub(super) fn has_begun(&self) -> bool {
        !self.stamps.is_empty()
    }

    /// Takes the next frame; answers what is to be recorded now.
    pub(super) fn push(&mut self, frame: Arc<Frame>) -> Vec<Chosen> {
        let Some(window) = self.window.filter(|window| frame.t_us >= window.from_us) else {
            self.wait(frame);
            return Vec::new();
        };
        if self.done {
            return Vec::new();
        }
        let mut chosen = Vec::new();
        if self.stamps.is_empty() {
            chosen = self.begin(&frame);
        }
        let hold = (1.5e6 / self.fps) as i64;
        if frame.t_us >= window.to_us.saturating_add(hold) {
            self.done = true;
            return chosen;
        }
        let delivered = Some(self.stamps.len());
        self.stamps.push(stamp_of(&frame));
        let near_end = frame.t_us >= window.to_us.saturating_sub(hold);
        let next = Chosen { frame, delivered };
        if near_end || !self.held.is_empty() {
            self.held.push_back(next);
        } else {
            chosen.push(next);
        }
        chosen
    }

    fn wait(&mut self, frame: Arc<Frame>) {
        self.before = Some(stamp_of(&frame));
        let newest = frame.t_us;
        self.ring_bytes += frame.data.len();
        self.keys += usize::from(self.is_key(&frame));
        self.ring.push_back(frame);
        while let Some(oldest) = self.ring.front()
            && (self.ring_bytes > RING_BYTES
                || newest.saturating_sub(oldest.t_us) > RING_US && !self.carries_the_rest())
        {
            self.ring_bytes -= oldest.data.len();
            self.keys -= usize::from(self.is_key(oldest));
            self.dropped = Some(stamp_of(oldest));
            self.ring.pop_front();
        }
    }

    /// Whether the oldest frame that waits is the one on which all later ones build: some cameras
    /// send a key frame every ten seconds only.
    fn carries_the_rest(&self) -> bool {
        self.keys == 1 && self.ring.front().is_some_and(|oldest| self.is_key(oldest))
    }

    /// Whether a chain of frames begins with this one.
    fn is_key(&self, frame: &Frame) -> bool {
        self.begins_chain.is_some_and(|begins| begins(&frame.data))
    }

    /// What a decoder needs before the turn's first frame.
    fn begin(&mut self, first: &Frame) -> Vec<Chosen> {
        let mut ring = std::mem::take(&mut self.ring);
        let Some(begins) = self.begins_chain.filter(|begins| !begins(&first.data)) else {
            return Vec::new();
        };
        let Some(key) = ring.iter().rposition(|frame| begins(&frame.data)) else {
            return Vec::new();
        };
        let lead = ring.drain(key..);
        lead.map(|frame| Chosen {
            frame,
            delivered: None,
        })
        .collect()
    }

    /// Ends the turn, whether it is over or not: what is still to be recorded, and the count.
    pub(super) fn end(&mut self) -> (Vec<Chosen>, Count) {
        let Some(window) = self.window else {
            return (Vec::new(), Count::of_nothing());
        };
        let count = self.count(window);
        let of_turn =
            |chosen: &Chosen| chosen.delivered.is_none_or(|at| at < count.exposures.len());
        let rest = self.held.drain(..).filter(of_turn).collect();
        (rest, count)
    }

    fn count(&self, window: Window) -> Count {
        // With the frame before the turn, what is missing at its begin shows as any other gap.
        let lead_in = usize::from(self.before.is_some() && !self.stamps.is_empty());
        let before = self.before.into_iter().take(lead_in);
        let all: Vec<Stamp> = before.chain(self.stamps.iter().copied()).collect();
        let trace = Trace::of(&all, self.fps);
        let nominal = 1e6 / self.fps;
        let measured = all.len() >= FEWEST_FOR_RATE;
        let period = if measured { trace.period_us } else { nominal };
        let length = (window.to_us as f64 - window.from_us as f64) / period;
        let expected = length.round().max(1.0) as u64;
        let Some(&first) = trace.exposures.get(lead_in) else {
            return Count {
                missing: run(0, expected, 0, Witness::Time).into_iter().collect(),
                expected,
                ..Count::of_nothing()
            };
        };
        // Exposures of the turn before its first frame.
        let due = trace.start_us + period * first as f64;
        let late = (due - window.from_us as f64) / period;
        let lead = match self.before {
            // Only those between both can be missing.
            Some(before) if before.t_us < window.from_us => {
                (late as u64).min(first.saturating_sub(1))
            }
            Some(_) => late as u64,
            // The stream began with this frame: one period late is not yet one frame too few.
            None => (late - 0.45).max(0.0) as u64,
        };
        let exposures: Vec<u64> = trace.exposures[lead_in..]
            .iter()
            .map(|exposure| exposure - first + lead)
            .take_while(|&exposure| exposure < expected)
            .collect();
        Count {
            missing: missing_in(&trace, &exposures, lead_in, expected),
            doubts: shifted(&trace.doubts, lead_in, exposures.len()),
            counts: trace.counter == super::trace::Counter::Counts,
            expected,
            exposures,
        }
    }
}

impl Count {
    fn of_nothing() -> Self {
        Self {
            expected: 0,
            exposures: Vec::new(),
            missing: Vec::new(),
            doubts: Vec::new(),
            counts: false,
        }
    }
}

/// The gaps of the turn: before, between and behind the delivered frames.
fn missing_in(trace: &Trace, exposures: &[u64], lead_in: usize, expected: u64) -> Vec<Missing> {
    let witness = |before: usize| {
        let found = trace
            .missing
            .iter()
            .find(|missing| missing.before == before);
        found.map_or(Witness::Time, |missing| missing.seen_by)
    };
    let mut due = 0;
    let mut missing = Vec::new();
    for (before, &exposure) in exposures.iter().enumerate() {
        missing.extend(run(due, exposure, before, witness(before + lead_in)));
        due = exposure + 1;
    }
    missing.extend(run(due, expected, exposures.len(), Witness::Time));
    missing
}

/// The missing exposures from one number up to another, if there are any.
fn run(from: u64, to: u64, before: usize, seen_by: Witness) -> Option<Missing> {
    (to > from).then_some(Missing {
        exposure: from,
        count: to - from,
        before,
        seen_by,
    })
}

/// Doubts by the turn's own frames: without those of frames that do not belong to it.
fn shifted(doubts: &[Doubt], lead_in: usize, frames: usize) -> Vec<Doubt> {
    let place = |at: usize| at.checked_sub(lead_in).filter(|&at| at < frames);
    let moved = |doubt: &Doubt| {
        Some(match *doubt {
            Doubt::Contradiction {
                before,
                counted,
                timed,
            } => {
                let before = place(before)?;
                Doubt::Contradiction {
                    before,
                    counted,
                    timed,
                }
            }
            Doubt::OddTime { frame, off } => Doubt::OddTime {
                frame: place(frame)?,
                off,
            },
            Doubt::SamePeriod { frame } => Doubt::SamePeriod {
                frame: place(frame)?,
            },
            other @ (Doubt::Irregular | Doubt::Rate { .. }) => other,
        })
    };
    doubts.iter().filter_map(moved).collect()
}

fn stamp_of(frame: &Frame) -> Stamp {
    Stamp {
        sequence: frame.sequence.map(|sequence| sequence.unwrapped),
        t_us: frame.t_us,
    }
}

#[cfg(test)]
mod tests;
