//! Cutting the frames of a turn out of a camera's stream.
//!
//! When the turn begins is often known only after it began: the table's motion is fitted first. So
//! the frames of the last seconds wait in a pre-roll buffer. Frames near the turn's end wait until
//! the camera's true rate is known from all of them, since it decides how many exposures the turn
//! has.

use std::collections::VecDeque;
use std::sync::Arc;

use super::progress::Window;
use super::timing::{FrameStamp, FrameTiming, MissingFrames, TimingAnomaly, gaps};
use relit_camera::Frame;

/// How long a frame waits for a turn to be announced, microseconds.
const PRE_ROLL_US: i64 = 4_000_000;
/// Most bytes that wait.
const PRE_ROLL_BYTES: usize = 96 << 20;
/// Frames from which on the measured rate is used instead of the agreed one.
const MIN_FOR_RATE: usize = 30;

/// Whether decoding can begin with a frame, by its data.
pub(super) type KeyFrameCheck = fn(&[u8]) -> bool;

/// A frame that is to be recorded.
#[derive(Debug, Clone)]
pub(super) struct TurnFrame {
    pub(super) frame: Arc<Frame>,
    /// Its index among the delivered frames of the turn; `None` for those before it, which a
    /// decoder needs.
    pub(super) delivered: Option<usize>,
}

/// What a turn should have, and what the camera delivered of it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TurnCount {
    /// Exposures of the turn, by the camera's own rate.
    pub(super) expected: u64,
    /// For each delivered frame of the turn, which exposure it is, from 0.
    pub(super) exposures: Vec<u64>,
    /// What the camera did not deliver: exposures of the turn, before which delivered frame.
    pub(super) missing: Vec<MissingFrames>,
    /// What does not fit.
    pub(super) anomalies: Vec<TimingAnomaly>,
    /// True where the driver's counter numbers the exposures.
    pub(super) counts: bool,
}

impl TurnCount {
    fn without_frames(expected: u64) -> Self {
        Self {
            expected,
            exposures: Vec::new(),
            missing: gaps(&[], expected),
            anomalies: Vec::new(),
            counts: false,
        }
    }
}

/// Selects the frames of one turn, in the order of their delivery.
pub(super) struct Trimmer {
    fps: f64,
    /// Where frames build on each other: which are key frames.
    is_key: Option<KeyFrameCheck>,
    window: Option<Window>,
    pre_roll: PreRoll,
    /// The last frame before the first of the turn.
    before: Option<FrameStamp>,
    stamps: Vec<FrameStamp>,
    /// Frames near the turn's end.
    held: VecDeque<TurnFrame>,
    done: bool,
}

impl Trimmer {
    pub(super) fn new(fps: f64, is_key: Option<KeyFrameCheck>) -> Self {
        Self {
            fps,
            is_key,
            window: None,
            pre_roll: PreRoll::default(),
            before: None,
            stamps: Vec::new(),
            held: VecDeque::new(),
            done: false,
        }
    }

    /// Sets when the turn is, once; returns what is to be recorded of the frames that wait.
    pub(super) fn announce(&mut self, window: Window) -> Vec<TurnFrame> {
        if self.window.is_some() {
            return Vec::new();
        }
        self.window = Some(window);
        let waiting = std::mem::take(&mut self.pre_roll);
        self.before = waiting.dropped;
        let frames = waiting.frames.into_iter();
        frames.flat_map(|frame| self.push(frame)).collect()
    }

    /// True once the window was announced.
    pub(super) fn knows_window(&self) -> bool {
        self.window.is_some()
    }

    /// True once a frame came after the turn.
    pub(super) fn is_done(&self) -> bool {
        self.done
    }

    /// Takes the next frame; returns what is to be recorded now.
    pub(super) fn push(&mut self, frame: Arc<Frame>) -> Vec<TurnFrame> {
        let Some(window) = self.window.filter(|window| frame.t_us >= window.from_us) else {
            self.before = Some(stamp_of(&frame));
            self.pre_roll.push(frame, self.is_key);
            return Vec::new();
        };
        if self.done {
            return Vec::new();
        }
        let mut selected = Vec::new();
        if self.stamps.is_empty() {
            selected = self.frames_to_decode_first(&frame);
        }
        let hold = (1.5e6 / self.fps) as i64;
        if frame.t_us >= window.to_us.saturating_add(hold) {
            self.done = true;
            return selected;
        }
        let delivered = Some(self.stamps.len());
        self.stamps.push(stamp_of(&frame));
        let near_end = frame.t_us >= window.to_us.saturating_sub(hold);
        let next = TurnFrame { frame, delivered };
        if near_end || !self.held.is_empty() {
            self.held.push_back(next);
        } else {
            selected.push(next);
        }
        selected
    }

    /// What a decoder needs before the turn's first frame.
    fn frames_to_decode_first(&mut self, first: &Frame) -> Vec<TurnFrame> {
        let mut waiting = std::mem::take(&mut self.pre_roll).frames;
        let Some(is_key) = self.is_key.filter(|is_key| !is_key(&first.data)) else {
            return Vec::new();
        };
        let Some(key) = waiting.iter().rposition(|frame| is_key(&frame.data)) else {
            return Vec::new();
        };
        let frames = waiting.drain(key..);
        frames
            .map(|frame| TurnFrame {
                frame,
                delivered: None,
            })
            .collect()
    }

    /// Ends the turn, whether it is over or not: what is still to be recorded, and the count.
    pub(super) fn end(&mut self) -> (Vec<TurnFrame>, TurnCount) {
        let Some(window) = self.window else {
            return (Vec::new(), TurnCount::without_frames(0));
        };
        let count = self.count(window);
        let of_turn =
            |frame: &TurnFrame| frame.delivered.is_none_or(|at| at < count.exposures.len());
        let rest = self.held.drain(..).filter(of_turn).collect();
        (rest, count)
    }

    fn count(&self, window: Window) -> TurnCount {
        // With the frame before the turn, what is missing at its beginning shows as any other gap.
        let before = self.before.filter(|_| !self.stamps.is_empty());
        let all: Vec<FrameStamp> = before
            .into_iter()
            .chain(self.stamps.iter().copied())
            .collect();
        let lead = all.len() - self.stamps.len();
        let timing = FrameTiming::from_stamps(&all, self.fps);
        let nominal = 1e6 / self.fps;
        let measured = all.len() >= MIN_FOR_RATE;
        let period = if measured { timing.period_us } else { nominal };
        let length = (window.to_us as f64 - window.from_us as f64) / period;
        let expected = length.round().max(1.0) as u64;
        let Some(&first) = timing.exposures.get(lead) else {
            return TurnCount::without_frames(expected);
        };
        // Exposures of the turn before its first frame.
        let due = timing.start_us + period * first as f64;
        let late = (due - window.from_us as f64) / period;
        let skipped = match self.before {
            // Only those between both can be missing.
            Some(before) if before.t_us < window.from_us => {
                (late as u64).min(first.saturating_sub(1))
            }
            Some(_) => late as u64,
            // The stream began with this frame: one period late is not yet one frame too few.
            None => (late - 0.45).max(0.0) as u64,
        };
        let exposures: Vec<u64> = timing.exposures[lead..]
            .iter()
            .map(|exposure| exposure - first + skipped)
            .take_while(|&exposure| exposure < expected)
            .collect();
        let anomalies = timing.anomalies.iter();
        TurnCount {
            missing: gaps(&exposures, expected),
            anomalies: anomalies
                .filter_map(|anomaly| anomaly.counted_from(lead, exposures.len()))
                .collect(),
            counts: timing.counts,
            expected,
            exposures,
        }
    }
}

/// Frames that wait for a turn to be announced.
#[derive(Default)]
struct PreRoll {
    frames: VecDeque<Arc<Frame>>,
    bytes: usize,
    /// Key frames among them.
    keys: usize,
    /// The last frame that was dropped because too many waited.
    dropped: Option<FrameStamp>,
}

impl PreRoll {
    fn push(&mut self, frame: Arc<Frame>, is_key: Option<KeyFrameCheck>) {
        let is_key = |frame: &Frame| is_key.is_some_and(|is_key| is_key(&frame.data));
        let newest = frame.t_us;
        self.bytes += frame.data.len();
        self.keys += usize::from(is_key(&frame));
        self.frames.push_back(frame);
        while let Some(oldest) = self.frames.front() {
            // Some cameras send a key frame every ten seconds only: all later frames build on it.
            let needed = self.keys == 1 && is_key(oldest);
            let old = newest.saturating_sub(oldest.t_us) > PRE_ROLL_US && !needed;
            if !old && self.bytes <= PRE_ROLL_BYTES {
                return;
            }
            self.bytes -= oldest.data.len();
            self.keys -= usize::from(is_key(oldest));
            self.dropped = Some(stamp_of(oldest));
            self.frames.pop_front();
        }
    }
}

fn stamp_of(frame: &Frame) -> FrameStamp {
    FrameStamp {
        sequence: frame.sequence,
        t_us: frame.t_us,
    }
}

#[cfg(test)]
mod tests;
