//! Which source frame stands for which sample: `samples` of them, evenly spread over one turn.

use super::Error;

/// A source frame that may be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Candidate {
    /// Position in the video.
    pub frame: u64,
    /// Time stamp, microseconds.
    pub t_us: i64,
    /// Angle of the table, degrees, where it is known.
    pub angle_deg: Option<f64>,
}

/// By what the samples are spread evenly.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Basis {
    /// By the table's angle.
    Angle,
    /// By time, over the whole video.
    Time,
}

/// The chosen frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    /// By what they were chosen.
    pub basis: Basis,
    /// The source frame of each sample, by index.
    pub frames: Vec<u64>,
    /// How far each sample's frame lies from the place it stands for, by index: degrees or
    /// microseconds.
    pub off_by: Vec<f64>,
    /// How much of a turn the candidates cover, degrees; `None` where there are no angles.
    pub covered_deg: Option<f64>,
}

/// A turn that lacks less than this counts as whole: its last samples repeat a frame, which is
/// flagged.
const TURN_TOLERANCE_DEG: f64 = 1.0;
const TURN_DEG: f64 = 360.0;

impl Selection {
    /// Chooses `samples` frames among the candidates, which are in order of time.
    ///
    /// By angle where every candidate has one: sample k is the frame nearest to the first frame's
    /// angle plus k / samples of a turn, in the direction in which the table turns. Where the
    /// candidates cover less than a turn, the samples are spread over what they cover. Without
    /// angles, the same over the time from the first frame to the end of the last.
    ///
    /// # Errors
    /// [`Error::NoFrameLeft`] without candidates, [`Error::TableStands`] where the angle does not
    /// change.
    pub fn choose(candidates: &[Candidate], samples: u32) -> Result<Self, Error> {
        if candidates.is_empty() {
            return Err(Error::NoFrameLeft);
        }
        let angles: Option<Vec<f64>> = candidates.iter().map(|c| c.angle_deg).collect();
        match angles {
            Some(angles) if candidates.len() > 1 => Self::by_angle(candidates, &angles, samples),
            _ => Ok(Self::by_time(candidates, samples)),
        }
    }

    fn by_angle(candidates: &[Candidate], angles: &[f64], samples: u32) -> Result<Self, Error> {
        let first = angles[0];
        let last = angles[angles.len() - 1];
        let turned: Vec<f64> = angles
            .iter()
            .map(|a| (a - first) * (last - first).signum())
            .collect();
        let span = turned[turned.len() - 1];
        if span < TURN_TOLERANCE_DEG {
            return Err(Error::TableStands { degrees: span });
        }
        let covered = span + median_step(&turned);
        let turn = if covered >= TURN_DEG - TURN_TOLERANCE_DEG {
            TURN_DEG
        } else {
            covered
        };
        let (frames, off_by) = nearest(candidates, &turned, turn, samples);
        let covered_deg = Some(covered.min(TURN_DEG));
        Ok(Self {
            basis: Basis::Angle,
            frames,
            off_by,
            covered_deg,
        })
    }

    fn by_time(candidates: &[Candidate], samples: u32) -> Self {
        let first = candidates[0].t_us;
        let times: Vec<f64> = candidates
            .iter()
            .map(|c| c.t_us.saturating_sub(first) as f64)
            .collect();
        let whole = times[times.len() - 1] + median_step(&times);
        let (frames, off_by) = nearest(candidates, &times, whole, samples);
        Self {
            basis: Basis::Time,
            frames,
            off_by,
            covered_deg: None,
        }
    }

    /// True where the candidates cover less than a turn.
    #[must_use]
    pub fn is_partial(&self) -> bool {
        self.covered_deg
            .is_some_and(|covered| covered < TURN_DEG - TURN_TOLERANCE_DEG)
    }
}

/// The median distance of neighbours, 0 for a single one.
fn median_step(positions: &[f64]) -> f64 {
    let mut steps: Vec<f64> = positions.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() {
        return 0.0;
    }
    steps.sort_by(f64::total_cmp);
    steps[steps.len() / 2]
}

/// For each of `samples` places, evenly spread over `whole` from 0 on, the candidate nearest to
/// it, the earlier one of two at the same distance; and the distances.
fn nearest(
    candidates: &[Candidate],
    positions: &[f64],
    whole: f64,
    samples: u32,
) -> (Vec<u64>, Vec<f64>) {
    let numbers = candidates.iter().map(|candidate| candidate.frame);
    let mut sorted: Vec<(f64, u64)> = positions.iter().copied().zip(numbers).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut at = 0;
    (0..samples)
        .map(|k| {
            let target = f64::from(k) * whole / f64::from(samples);
            let off = |at: usize| (sorted[at].0 - target).abs();
            while at + 1 < sorted.len() && off(at + 1) < off(at) {
                at += 1;
            }
            (sorted[at].1, off(at))
        })
        .unzip()
}

/// A place where frames seem to be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TimeGap {
    /// The frame after the gap.
    pub before: u64,
    /// How many frames would fit into it.
    pub missing: u64,
}

/// Finds gaps in the time stamps: neighbours more than 1.5 median steps apart.
#[must_use]
pub fn time_gaps(candidates: &[Candidate]) -> Vec<TimeGap> {
    let times: Vec<f64> = candidates.iter().map(|c| c.t_us as f64).collect();
    let step = median_step(&times);
    if step <= 0.0 {
        return Vec::new();
    }
    let pairs = times.windows(2).zip(&candidates[1..]);
    pairs
        .filter(|(pair, _)| pair[1] - pair[0] > 1.5 * step)
        .map(|(pair, after)| {
            let missing = ((pair[1] - pair[0]) / step).round() as u64 - 1;
            TimeGap {
                before: after.frame,
                missing: missing.max(1),
            }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn timed(times: impl IntoIterator<Item = i64>) -> Vec<Candidate> {
        let numbered = (0..).zip(times);
        numbered
            .map(|(frame, t_us)| Candidate {
                frame,
                t_us,
                angle_deg: None,
            })
            .collect()
    }

    fn turned(angles: impl IntoIterator<Item = f64>) -> Vec<Candidate> {
        let numbered = (0..).zip(angles);
        numbered
            .map(|(frame, angle)| Candidate {
                frame,
                t_us: frame as i64 * 33_333,
                angle_deg: Some(angle),
            })
            .collect()
    }

    #[test]
    fn as_many_samples_as_frames_take_each_frame_once() {
        let by_time = Selection::choose(&timed((0..1500).map(|n| n * 100_000 / 3)), 1500).unwrap();
        assert_eq!(by_time.frames, (0..1500).collect::<Vec<u64>>());
        let by_angle =
            Selection::choose(&turned((0..1500).map(|n| f64::from(n) * 0.24)), 1500).unwrap();
        assert_eq!(by_angle.frames, by_time.frames);
        assert_eq!((by_time.basis, by_angle.basis), (Basis::Time, Basis::Angle));
    }

    #[test]
    fn jitter_of_the_time_stamps_drops_no_frame() {
        let jitter = [0, 3000, -3000, 1000, -2000];
        let times = (0..1500).map(|n| n * 1_001_000 / 30 + jitter[n as usize % 5]);
        let selection = Selection::choose(&timed(times), 1500).unwrap();
        assert_eq!(selection.frames, (0..1500).collect::<Vec<u64>>());
    }

    #[test]
    fn dropped_frames_are_filled_from_their_neighbours_and_flagged() {
        let kept = (0..100).filter(|n| ![40, 41, 70].contains(n));
        let selection = Selection::choose(&timed(kept.map(|n| n * 33_333)), 100).unwrap();
        assert_eq!(selection.frames.len(), 100);
        assert_eq!(selection.frames[39..44], [39, 39, 40, 40, 41]);
        assert_eq!(selection.frames[69..72], [67, 67, 68]);
        // What stands in the video after the gaps still stands at its own place of the turn.
        assert_eq!(selection.frames[99], 96);
    }

    #[test]
    fn gaps_are_found_at_their_frames() {
        let kept = (0..100).filter(|n| ![40, 41, 70].contains(n));
        let gaps = time_gaps(&timed(kept.map(|n| n * 33_333)));
        assert_eq!(
            gaps,
            [
                TimeGap {
                    before: 40,
                    missing: 2
                },
                TimeGap {
                    before: 68,
                    missing: 1
                }
            ]
        );
    }

    #[test]
    fn a_table_that_turns_backwards_is_followed() {
        let angles = (0..150).map(|n| 5.0 - 2.4 * f64::from(n));
        let selection = Selection::choose(&turned(angles), 150).unwrap();
        assert_eq!(selection.frames, (0..150).collect::<Vec<u64>>());
    }

    #[test]
    fn frames_beyond_the_turn_are_left_out() {
        let angles = (0..1700).map(|n| f64::from(n) * 0.24);
        let selection = Selection::choose(&turned(angles), 1500).unwrap();
        assert_eq!(selection.frames, (0..1500).collect::<Vec<u64>>());
        assert_eq!(selection.covered_deg, Some(360.0));
    }

    #[test]
    fn half_a_turn_is_spread_over_all_samples_and_told() {
        let angles = (0..750).map(|n| f64::from(n) * 0.24);
        let selection = Selection::choose(&turned(angles), 1500).unwrap();
        assert!(selection.is_partial());
        assert!((selection.covered_deg.unwrap() - 180.0).abs() < 1e-6);
        assert_eq!(selection.frames[1499], 749);
    }

    #[test]
    fn a_frame_lost_at_the_end_does_not_stretch_the_turn() {
        let angles = (0..1498).map(|n| f64::from(n) * 0.24);
        let selection = Selection::choose(&turned(angles), 1500).unwrap();
        assert!(!selection.is_partial());
        assert_eq!(selection.frames[..1498], (0..1498).collect::<Vec<u64>>());
        assert_eq!(selection.frames[1498..], [1497, 1497]);
    }

    #[test]
    fn a_table_that_stands_is_refused() {
        let candidates = turned((0..100).map(|n| f64::from(n) * 1e-4));
        let error = Selection::choose(&candidates, 100).unwrap_err();
        assert!(matches!(error, Error::TableStands { .. }), "{error}");
    }

    proptest! {
        #[test]
        fn every_sample_gets_a_candidate_in_order_of_time(
            steps in prop::collection::vec(1_i64..100_000, 1..200),
            samples in 1_u32..400,
        ) {
            let times = steps.iter().scan(0, |t, step| { *t += step; Some(*t) });
            let candidates = timed(times);
            let selection = Selection::choose(&candidates, samples).unwrap();
            prop_assert_eq!(selection.frames.len(), samples as usize);
            prop_assert_eq!(selection.frames[0], 0);
            prop_assert!(selection.frames.windows(2).all(|pair| pair[0] <= pair[1]));
        }
    }
}
