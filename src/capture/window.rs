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
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::capture::tests::frame;

    /// Plays frames into a cutter, announces the window when frame `at` has come, and answers the
    /// numbers of the frames chosen, and the count.
    fn cut(frames: impl Iterator<Item = Frame>, window: Window, at: usize) -> (Vec<i64>, Count) {
        let mut cutter = Cutter::new(30.0, None);
        let mut chosen = Vec::new();
        for (n, frame) in frames.enumerate() {
            chosen.extend(cutter.push(Arc::new(frame)));
            if n == at {
                chosen.extend(cutter.announce(window));
            }
        }
        let (rest, count) = cutter.end();
        chosen.extend(rest);
        let number = |chosen: &Chosen| (chosen.frame.t_us as f64 / 33_333.3).round() as i64;
        (chosen.iter().map(number).collect(), count)
    }

    fn frames(numbers: impl Iterator<Item = u64>) -> impl Iterator<Item = Frame> {
        numbers.map(|n| {
            let mut frame = frame(n);
            frame.t_us = (33_333.3 * n as f64) as i64;
            frame
        })
    }

    fn seconds(from: f64, to: f64) -> Window {
        Window::new((from * 1e6) as i64, (to * 1e6) as i64).unwrap()
    }

    #[test]
    fn fifty_seconds_at_thirty_frames_a_second_are_1500_frames() {
        for at in [0, 40] {
            let (chosen, count) = cut(frames(0..1600), seconds(1.01, 51.01), at);
            assert_eq!(chosen, (31..1531).collect::<Vec<_>>());
            assert_eq!((count.expected, count.missing_count()), (1500, 0));
            assert!(count.doubts.is_empty());
        }
    }

    #[test]
    fn a_stream_that_ends_with_the_turn_is_whole() {
        let (chosen, count) = cut(frames(0..1500), seconds(0.0, 50.0), 0);
        assert_eq!(chosen.len(), 1500);
        assert_eq!((count.expected, count.missing_count()), (1500, 0));
    }

    #[test]
    fn frames_missing_at_both_ends_and_between_are_counted_in_the_turn() {
        let lost = |n: &u64| ![29, 30, 31, 100, 101, 328, 329, 330].contains(n);
        let (chosen, count) = cut(frames((0..400).filter(lost)), seconds(0.99, 10.99), 0);
        assert_eq!(chosen.len(), 300 - 6);
        let found: Vec<_> = count
            .missing
            .iter()
            .map(|m| (m.exposure, m.count, m.before))
            .collect();
        assert_eq!(found, [(0, 2, 0), (70, 2, 68), (298, 2, 294)]);
    }

    #[test]
    fn a_turn_that_is_announced_too_late_lacks_its_begin() {
        let (chosen, count) = cut(frames(0..600), seconds(1.01, 11.01), 200);
        assert_eq!(count.expected, 300);
        assert_eq!(count.exposures.len(), chosen.len());
        assert_eq!(count.missing[0].before, 0);
        assert_eq!(count.missing_count(), 300 - chosen.len() as u64);
        assert!(count.missing_count() > 40);
    }

    #[test]
    fn a_stream_that_breaks_off_lacks_the_rest() {
        let (chosen, count) = cut(frames(0..130), seconds(0.99, 10.99), 0);
        assert_eq!(chosen.len(), 100);
        assert_eq!(count.missing_count(), 200);
        assert_eq!(count.missing.last().unwrap().before, 100);
    }

    #[test]
    fn without_any_frame_all_of_the_turn_is_missing() {
        let (chosen, count) = cut(frames(0..3), seconds(5.0, 15.0), 0);
        assert!(chosen.is_empty());
        assert_eq!((count.expected, count.missing_count()), (300, 300));
    }

    #[test]
    fn a_chain_of_frames_is_recorded_from_its_key_frame_on() {
        let mut cutter = Cutter::new(30.0, Some(|data| data == [1]));
        let mut chosen = Vec::new();
        for (n, mut frame) in frames(0..100).enumerate() {
            frame.data = vec![u8::from(n % 12 == 0)];
            chosen.extend(cutter.push(Arc::new(frame)));
            if n == 35 {
                chosen.extend(cutter.announce(seconds(1.01, 2.01)));
            }
        }
        let (rest, count) = cutter.end();
        chosen.extend(rest);
        // The turn begins with frame 31, the chain with frame 24.
        let lead = chosen
            .iter()
            .filter(|chosen| chosen.delivered.is_none())
            .count();
        assert_eq!((lead, chosen.len() - lead, count.expected), (7, 30, 30));
        assert_eq!(chosen[0].frame.data, [1]);
    }

    #[test]
    fn a_chain_is_kept_from_its_key_frame_on_however_long_ago_that_was() {
        let mut cutter = Cutter::new(30.0, Some(|data| data == [1]));
        let mut chosen = Vec::new();
        for (n, mut frame) in frames(0..600).enumerate() {
            frame.data = vec![u8::from(n % 250 == 0)];
            chosen.extend(cutter.push(Arc::new(frame)));
            if n == 480 {
                chosen.extend(cutter.announce(seconds(15.01, 17.01)));
            }
        }
        let (rest, count) = cutter.end();
        chosen.extend(rest);
        assert_eq!((count.expected, count.missing_count()), (60, 0));
        assert_eq!(chosen[0].frame.data, [1]);
        // From frame 250 on, before frame 451.
        assert_eq!(chosen.len(), 201 + 60);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(300))]

        #[test]
        fn a_steady_stream_gives_exactly_the_turn_s_frames_wherever_it_begins(
            from in 1_000_000_i64..2_000_000, rate in -0.0002_f64..0.0002, jitter in 0_i64..13_000,
            seed in any::<u64>(),
        ) {
            let window = Window::new(from, from + 20_000_000).unwrap();
            let mut state = seed;
            let stream = (0..720_u64).map(|n| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                let off = (state >> 33) as i64 % (2 * jitter + 1) - jitter;
                let mut frame = frame(n);
                frame.t_us = (33_333.333 * (1.0 + rate) * n as f64) as i64 + off;
                frame
            });
            let (chosen, count) = cut(stream, window, 0);
            prop_assert_eq!((count.expected, count.missing_count()), (600, 0), "{:?}", count.missing);
            prop_assert_eq!(chosen.len(), 600);
        }
    }
}
