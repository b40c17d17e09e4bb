//! Shifts of frames that could not be registered, from those around them.
//!
//! A rig drifts slowly and shakes fast. Which of both tells where the object is in a frame that shows too little, the
//! turn itself says: each way of predicting is tried on the frames that were registered, as far from the frames that
//! it uses, and the one that errs less there predicts. How much it erred is the uncertainty.

use std::collections::{BTreeMap, HashMap};

use relit_data::statistics::upper_median;

use super::Alignment;

/// The registered frames on both sides are at most so many frames apart.
const MAX_APART: u64 = 40;
/// Frames on each side whose middle place is one of the predictions.
const AROUND: u64 = 24;
/// Fewest frames on which a prediction is tried.
const MIN_TRIED: usize = 30;
/// A shift that is more uncertain is not taken, pixels.
const MAX_UNCERTAIN: f64 = 1.0;

/// A shift that was not measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct InterpolatedShift {
    /// To the right and down, pixels.
    pub(super) shift: [f64; 2],
    /// Root mean square of the errors of such shifts where the measured one is known, pixels.
    pub(super) uncertainty: f64,
}

/// The shifts of a turn's frames.
#[derive(Debug, Default)]
pub(super) struct ShiftCourse {
    registered: BTreeMap<u64, [f64; 2]>,
}

/// A way of predicting a frame's shift from the registered frames outside of the gap in which it lies.
type Prediction = fn(&BTreeMap<u64, [f64; 2]>, u64, (u64, u64)) -> Option<[f64; 2]>;

impl ShiftCourse {
    /// Notes a frame, if it was registered.
    pub(super) fn add(&mut self, frame: u64, alignment: &Alignment) {
        if let Some(shift) = alignment.shift {
            self.registered.insert(frame, shift);
        }
    }

    /// The shifts of these frames, as far as the frames around them tell.
    pub(super) fn fill(
        &self,
        frames: impl Iterator<Item = u64>,
    ) -> HashMap<u64, InterpolatedShift> {
        let filled = frames.filter_map(|frame| Some((frame, self.interpolated(frame)?)));
        filled.collect()
    }

    fn interpolated(&self, frame: u64) -> Option<InterpolatedShift> {
        let (&before, _) = self.registered.range(..frame).next_back()?;
        let (&after, _) = self.registered.range(frame + 1..).next()?;
        let gap = (frame - before, after - frame);
        if after - before > MAX_APART {
            return None;
        }
        let ways: [Prediction; 2] = [straight, middle];
        let tried = ways.into_iter().filter_map(|way| {
            let shift = way(&self.registered, frame, gap)?;
            let uncertainty = self.error_of(way, gap)?;
            Some(InterpolatedShift { shift, uncertainty })
        });
        tried
            .min_by(|a, b| a.uncertainty.total_cmp(&b.uncertainty))
            .filter(|found| found.uncertainty <= MAX_UNCERTAIN)
    }

    /// How much a prediction errs on frames whose shift was measured.
    fn error_of(&self, way: Prediction, gap: (u64, u64)) -> Option<f64> {
        let square = |(&frame, shift): (&u64, &[f64; 2])| {
            let [x, y] = way(&self.registered, frame, gap)?;
            Some((x - shift[0]).powi(2) + (y - shift[1]).powi(2))
        };
        let squares: Vec<f64> = self.registered.iter().filter_map(square).collect();
        let enough = squares.len() >= MIN_TRIED;
        enough.then(|| (squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    }
}

/// On the straight line between the frames at the gap's ends.
fn straight(
    registered: &BTreeMap<u64, [f64; 2]>,
    frame: u64,
    (back, ahead): (u64, u64),
) -> Option<[f64; 2]> {
    let before = registered.get(&frame.checked_sub(back)?)?;
    let after = registered.get(&(frame + ahead))?;
    let part = back as f64 / (back + ahead).max(1) as f64;
    Some([0, 1].map(|axis| before[axis] + part * (after[axis] - before[axis])))
}

/// In the middle of the frames around the gap.
fn middle(
    registered: &BTreeMap<u64, [f64; 2]>,
    frame: u64,
    (back, ahead): (u64, u64),
) -> Option<[f64; 2]> {
    let before = frame.saturating_sub(AROUND)..=frame.checked_sub(back)?;
    let after = frame + ahead..=frame + AROUND.max(ahead);
    let around: Vec<&[f64; 2]> = registered
        .range(before)
        .chain(registered.range(after))
        .map(|(_, shift)| shift)
        .collect();
    let median = |axis: usize| upper_median(around.iter().map(|shift| shift[axis]));
    Some([median(0)?, median(1)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A turn of 200 frames without those of `lost`.
    fn course(shift: impl Fn(u64) -> [f64; 2], lost: &[u64]) -> ShiftCourse {
        let mut course = ShiftCourse::default();
        for frame in (0..200).filter(|frame| !lost.contains(frame)) {
            let alignment = Alignment {
                shift: Some(shift(frame)),
                uncertainty: 0.05,
                confidence: 0.9,
                turned: None,
            };
            course.add(frame, &alignment);
        }
        course
    }

    #[test]
    fn a_drift_is_followed_and_its_uncertainty_is_small() {
        let drift = |frame: u64| [0.02 * frame as f64, -0.01 * frame as f64];
        let filled = course(drift, &[90, 91, 92]).fill([91, 150].into_iter());
        let found = filled[&91];
        assert!((found.shift[0] - 1.82).abs() < 1e-9 && (found.shift[1] + 0.91).abs() < 1e-9);
        assert!(found.uncertainty < 1e-6, "{found:?}");
    }

    #[test]
    fn where_the_rig_shakes_the_middle_is_taken_and_the_shaking_is_the_uncertainty() {
        let shaken = |frame: u64| {
            [
                if frame.is_multiple_of(2) { 0.5 } else { -0.5 } + 0.001 * (frame % 7) as f64,
                0.0,
            ]
        };
        let filled = course(shaken, &[90]).fill([90].into_iter());
        let found = filled[&90];
        assert!((0.4..=1.0).contains(&found.uncertainty), "{found:?}");
        let jolted = |frame: u64| [3.0 * ((frame * 7 % 5) as f64 - 2.0), 0.0];
        assert!(course(jolted, &[90]).fill([90].into_iter()).is_empty());
    }

    #[test]
    fn nothing_is_guessed_at_the_ends_nor_over_a_long_gap() {
        let still = |_| [0.1, 0.2];
        let long: Vec<u64> = (60..110).collect();
        let filled = course(still, &[&long[..], &[0, 199]].concat()).fill([0, 80, 199].into_iter());
        assert!(filled.is_empty(), "{filled:?}");
    }
}
