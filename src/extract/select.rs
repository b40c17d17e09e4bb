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

/// A turn that lacks less than this counts as whole: its last samples repeat a frame, which is
/// flagged.
const TURN_TOLERANCE_DEG: f64 = 1.0;
const TURN_DEG: f64 = 360.0;

/// The stretch over which samples are spread: from where, in which direction, how far.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Turn {
    basis: Basis,
    /// Angle (degrees) or time stamp (microseconds) of sample 0.
    origin: f64,
    /// 1 or -1.
    direction: f64,
    /// Degrees or microseconds.
    extent: f64,
    covered_deg: Option<f64>,
}

impl Turn {
    /// The turn that these candidates, in order of time, show.
    ///
    /// By angle where every candidate has one: a full turn from the first frame's angle in the
    /// direction in which the table turns, or as much of it as the candidates cover. Without angles,
    /// the time from the first frame to the end of the last.
    ///
    /// # Errors
    /// [`Error::NoFrameLeft`] without candidates, [`Error::OneFrame`] with one,
    /// [`Error::TableStands`] where the angle does not change.
    pub fn of(candidates: &[Candidate]) -> Result<Self, Error> {
        let (first, last) = match candidates {
            [] => return Err(Error::NoFrameLeft),
            [_] => return Err(Error::OneFrame),
            [first, .., last] => (first, last),
        };
        let all_have_angles = candidates
            .iter()
            .all(|candidate| candidate.angle_deg.is_some());
        let mut turn = match (first.angle_deg, last.angle_deg) {
            (Some(from), Some(to)) if all_have_angles => {
                Self::from(Basis::Angle, from, if to < from { -1.0 } else { 1.0 })
            }
            _ => Self::from(Basis::Time, first.t_us as f64, 1.0),
        };
        let places: Vec<f64> = candidates
            .iter()
            .map(|candidate| turn.place(candidate))
            .collect();
        let span = turn.place(last);
        turn.extent = span + median_step(&places);
        if turn.basis == Basis::Angle {
            if span < TURN_TOLERANCE_DEG {
                return Err(Error::TableStands { degrees: span });
            }
            turn.covered_deg = Some(turn.extent.min(TURN_DEG));
            if turn.extent >= TURN_DEG - TURN_TOLERANCE_DEG {
                turn.extent = TURN_DEG;
            }
        }
        Ok(turn)
    }

    fn from(basis: Basis, origin: f64, direction: f64) -> Self {
        Self {
            basis,
            origin,
            direction,
            extent: 0.0,
            covered_deg: None,
        }
    }

    /// Where a candidate stands, from the turn's begin on.
    fn place(&self, candidate: &Candidate) -> f64 {
        let at = match (self.basis, candidate.angle_deg) {
            (Basis::Angle, Some(angle)) => angle,
            _ => candidate.t_us as f64,
        };
        (at - self.origin) * self.direction
    }

    /// For each of `samples` places, evenly spread over the turn, the candidate nearest to it, the
    /// earlier one of two at the same distance; and the distances.
    fn nearest(&self, candidates: &[Candidate], samples: u32) -> (Vec<u64>, Vec<f64>) {
        let mut sorted: Vec<(f64, u64)> = candidates
            .iter()
            .map(|candidate| (self.place(candidate), candidate.frame))
            .collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let first_from = |place: f64| sorted.partition_point(|candidate| candidate.0 < place);
        (0..samples)
            .map(|k| {
                let target = f64::from(k) * self.extent / f64::from(samples);
                let off = |at: usize| (sorted[at].0 - target).abs();
                let after = first_from(target);
                let before = after.checked_sub(1).map(|last| first_from(sorted[last].0));
                let at = match before {
                    Some(before) if after == sorted.len() || off(before) <= off(after) => before,
                    _ => after,
                };
                (sorted[at].1, off(at))
            })
            .unzip()
    }
}

/// The chosen frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Selection {
    turn: Turn,
    /// The source frame of each sample, by index.
    pub frames: Vec<u64>,
    /// How far each sample's frame lies from the place it stands for, by index: degrees or
    /// microseconds.
    pub off_by: Vec<f64>,
}

impl Selection {
    /// Chooses `samples` frames, evenly spread over the turn that the candidates show.
    ///
    /// # Errors
    /// As [`Turn::of`].
    pub fn choose(candidates: &[Candidate], samples: u32) -> Result<Self, Error> {
        Self::among(candidates, Turn::of(candidates)?, samples)
    }

    /// Chooses `samples` frames, evenly spread over a turn that is known.
    ///
    /// # Errors
    /// [`Error::NoFrameLeft`] without candidates.
    pub fn among(candidates: &[Candidate], turn: Turn, samples: u32) -> Result<Self, Error> {
        if candidates.is_empty() {
            return Err(Error::NoFrameLeft);
        }
        let (frames, off_by) = turn.nearest(candidates, samples);
        Ok(Self {
            turn,
            frames,
            off_by,
        })
    }

    /// The turn over which the samples are spread.
    #[must_use]
    pub fn turn(&self) -> Turn {
        self.turn
    }

    /// By what the samples are spread.
    #[must_use]
    pub fn basis(&self) -> Basis {
        self.turn.basis
    }

    /// How much of a turn the candidates cover, 0..=360 degrees; `None` where there are no angles.
    #[must_use]
    pub fn covered_deg(&self) -> Option<f64> {
        self.turn.covered_deg
    }

    /// True where the candidates cover less than a turn.
    #[must_use]
    pub fn is_partial(&self) -> bool {
        self.covered_deg()
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

/// The first frame at which the table runs back against its direction by more than a degree.
#[must_use]
pub fn runs_back_at(candidates: &[Candidate]) -> Option<u64> {
    let angles: Option<Vec<f64>> = candidates.iter().map(|c| c.angle_deg).collect();
    let angles = angles?;
    let direction = (angles.last()? - angles.first()?).signum();
    let back = |pair: &[f64]| (pair[1] - pair[0]) * direction < -1.0;
    let at = angles.windows(2).position(back)?;
    Some(candidates[at + 1].frame)
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
        assert_eq!(
            (by_time.basis(), by_angle.basis()),
            (Basis::Time, Basis::Angle)
        );
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
        assert_eq!(selection.covered_deg(), Some(360.0));
    }

    #[test]
    fn half_a_turn_is_spread_over_all_samples_and_told() {
        let angles = (0..750).map(|n| f64::from(n) * 0.24);
        let selection = Selection::choose(&turned(angles), 1500).unwrap();
        assert!(selection.is_partial());
        assert!((selection.covered_deg().unwrap() - 180.0).abs() < 1e-6);
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

    #[test]
    fn an_angle_that_runs_back_is_found() {
        let angles =
            |wrong: f64| (0..150).map(move |n| if n == 50 { wrong } else { 2.4 * f64::from(n) });
        assert_eq!(runs_back_at(&turned(angles(0.0))), Some(50));
        assert_eq!(runs_back_at(&turned(angles(120.0))), None);
        let backwards = angles(120.0).map(|angle| -angle);
        assert_eq!(runs_back_at(&turned(backwards)), None);
    }

    #[test]
    fn a_repeated_angle_holds_up_nothing() {
        for doubled in [1, 59] {
            let angles = (0..150).map(|n| 2.4 * f64::from(if n == doubled { n - 1 } else { n }));
            let selection = Selection::choose(&turned(angles), 150).unwrap();
            let wanted = (0..150).map(|n| if n == doubled as u64 { n - 1 } else { n });
            assert_eq!(selection.frames, wanted.collect::<Vec<u64>>());
        }
    }

    #[test]
    fn frames_lost_at_the_start_shift_no_other_sample() {
        let candidates = turned((0..150).map(|n| f64::from(n) * 2.4));
        let turn = Turn::of(&candidates).unwrap();
        let again = Selection::among(&candidates[10..], turn, 150).unwrap();
        assert_eq!(again.frames[..10], [10; 10]);
        assert_eq!(again.frames[10..], (10..150).collect::<Vec<u64>>());
    }

    proptest! {
        #[test]
        fn every_sample_gets_a_candidate_in_order_of_time(
            steps in prop::collection::vec(0_i64..100_000, 2..200),
            samples in 1_u32..400,
        ) {
            let times = steps.iter().scan(0, |t, step| { *t += step; Some(*t) });
            let candidates = timed(times);
            let selection = Selection::choose(&candidates, samples).unwrap();
            prop_assert_eq!(selection.frames.len(), samples as usize);
            prop_assert_eq!(selection.frames[0], 0);
            prop_assert!(selection.frames.windows(2).all(|pair| pair[0] <= pair[1]));
            for (k, frame) in (0_u32..).zip(&selection.frames) {
                let place = |t_us: i64| (t_us - candidates[0].t_us) as f64;
                let target = f64::from(k) * selection.turn.extent / f64::from(samples);
                let off = (place(candidates[*frame as usize].t_us) - target).abs();
                let least = candidates.iter().map(|c| (place(c.t_us) - target).abs());
                prop_assert!(off <= least.fold(f64::INFINITY, f64::min));
            }
        }
    }
}
