//! Choosing the source frames of the samples, evenly spread over one turn.

use relit_data::shard::SamplingBasis;
use relit_data::statistics::upper_median;

use super::ExtractError;

/// A source frame that may be chosen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Candidate {
    /// Position in the video.
    pub(super) frame: u64,
    /// Time stamp, microseconds.
    pub(super) t_us: i64,
    /// Angle of the table, degrees, where it is known.
    pub(super) angle_deg: Option<f64>,
}

/// A turn that lacks less than this counts as complete: its last samples repeat a frame, which is
/// flagged.
pub(super) const TURN_TOLERANCE_DEG: f64 = 1.0;
pub(super) const TURN_DEG: f64 = 360.0;

/// The range over which samples are spread: its start, direction and extent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TurnSpan {
    basis: SamplingBasis,
    /// Angle (degrees) or time stamp (microseconds) of sample 0.
    origin: f64,
    /// 1 or -1.
    direction: f64,
    /// Degrees or microseconds.
    extent: f64,
    /// From sample 0 to where the last candidate is nearer than a further one would be.
    reach: f64,
    covered_deg: Option<f64>,
}

impl TurnSpan {
    /// The span of these candidates, which are in order of time.
    ///
    /// If every candidate has an angle: a full turn from the first frame's angle in the direction in
    /// which the table turns; the candidates may cover only a part. Otherwise: the time from the
    /// first frame to the end of the last.
    ///
    /// # Errors
    /// [`ExtractError::Refused`] without candidates, [`ExtractError::OneFrame`] with one,
    /// [`ExtractError::TableStands`] if the angle does not change.
    pub(super) fn from_candidates(candidates: &[Candidate]) -> Result<Self, ExtractError> {
        let (first, last) = match candidates {
            [] => return Err(no_frame_left()),
            [_] => return Err(ExtractError::OneFrame),
            [first, .., last] => (first, last),
        };
        let all_have_angles = candidates
            .iter()
            .all(|candidate| candidate.angle_deg.is_some());
        let mut span = match (first.angle_deg, last.angle_deg) {
            (Some(from), Some(to)) if all_have_angles => {
                let direction = if to < from { -1.0 } else { 1.0 };
                Self::starting_at(SamplingBasis::Angle, from, direction)
            }
            _ => Self::starting_at(SamplingBasis::Time, first.t_us as f64, 1.0),
        };
        let positions: Vec<f64> = candidates
            .iter()
            .map(|candidate| span.position(candidate))
            .collect();
        let to_last = span.position(last);
        let step = median_step(&positions);
        span.extent = to_last + step;
        span.reach = f64::INFINITY;
        if span.basis == SamplingBasis::Angle {
            if to_last < TURN_TOLERANCE_DEG {
                return Err(ExtractError::TableStands { degrees: to_last });
            }
            span.covered_deg = Some(span.extent.min(TURN_DEG));
            if span.extent < TURN_DEG - TURN_TOLERANCE_DEG {
                span.reach = to_last + step / 2.0;
            }
            span.extent = TURN_DEG;
        }
        Ok(span)
    }

    fn starting_at(basis: SamplingBasis, origin: f64, direction: f64) -> Self {
        Self {
            basis,
            origin,
            direction,
            extent: 0.0,
            reach: 0.0,
            covered_deg: None,
        }
    }

    /// The position of a candidate relative to the start of the span.
    fn position(&self, candidate: &Candidate) -> f64 {
        let at = match (self.basis, candidate.angle_deg) {
            (SamplingBasis::Angle, Some(angle)) => angle,
            _ => candidate.t_us as f64,
        };
        (at - self.origin) * self.direction
    }

    /// For each of `samples` positions, evenly spread over the span, the nearest candidate (the
    /// earlier one of two at the same distance) and its distance; of part of a turn, for the
    /// positions that are there.
    fn nearest(&self, candidates: &[Candidate], samples: u32) -> (Vec<u64>, Vec<f64>) {
        let mut sorted: Vec<(f64, u64)> = candidates
            .iter()
            .map(|candidate| (self.position(candidate), candidate.frame))
            .collect();
        sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let first_from = |position: f64| sorted.partition_point(|candidate| candidate.0 < position);
        (0..samples)
            .map(|k| f64::from(k) * self.extent / f64::from(samples))
            .take_while(|&target| target <= self.reach)
            .map(|target| {
                let distance = |at: usize| (sorted[at].0 - target).abs();
                let after = first_from(target);
                let before = after.checked_sub(1).map(|last| first_from(sorted[last].0));
                let at = match before {
                    Some(before)
                        if after == sorted.len() || distance(before) <= distance(after) =>
                    {
                        before
                    }
                    _ => after,
                };
                (sorted[at].1, distance(at))
            })
            .unzip()
    }
}

/// The chosen frames.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Selection {
    span: TurnSpan,
    /// The source frame of each sample, by index.
    pub(super) frames: Vec<u64>,
    /// The distance of each sample's frame from the sample's position, by index: degrees or
    /// microseconds.
    pub(super) distances: Vec<f64>,
}

impl Selection {
    /// Chooses `samples` frames, evenly spread over a turn; fewer where the candidates cover a part of it.
    ///
    /// # Errors
    /// As [`TurnSpan::from_candidates`].
    pub(super) fn choose(candidates: &[Candidate], samples: u32) -> Result<Self, ExtractError> {
        Self::among(candidates, TurnSpan::from_candidates(candidates)?, samples)
    }

    /// Chooses `samples` frames, evenly spread over a given span.
    ///
    /// # Errors
    /// [`ExtractError::Refused`] without candidates.
    pub(super) fn among(
        candidates: &[Candidate],
        span: TurnSpan,
        samples: u32,
    ) -> Result<Self, ExtractError> {
        if candidates.is_empty() {
            return Err(no_frame_left());
        }
        let (frames, distances) = span.nearest(candidates, samples);
        Ok(Self {
            span,
            frames,
            distances,
        })
    }

    /// The span over which the samples are spread.
    pub(super) fn span(&self) -> TurnSpan {
        self.span
    }

    /// The quantity over which the samples are evenly spread.
    pub(super) fn basis(&self) -> SamplingBasis {
        self.span.basis
    }

    /// The part of a turn that the candidates cover, 0..=360 degrees; `None` without angles.
    pub(super) fn covered_deg(&self) -> Option<f64> {
        self.span.covered_deg
    }

    /// True if the candidates cover less than a turn.
    pub(super) fn is_partial(&self) -> bool {
        self.covered_deg()
            .is_some_and(|covered| covered < TURN_DEG - TURN_TOLERANCE_DEG)
    }
}

fn no_frame_left() -> ExtractError {
    let text = "no frame of the video can be decoded: record it again, or give another file";
    ExtractError::Refused(text.to_owned())
}

/// The median distance between neighbours, 0 for a single position.
fn median_step(positions: &[f64]) -> f64 {
    let steps = positions.windows(2).map(|pair| pair[1] - pair[0]);
    upper_median(steps).unwrap_or_default()
}

/// The first frame at which the table goes back against its direction by more than a degree.
pub(super) fn reversal_frame(candidates: &[Candidate]) -> Option<u64> {
    let angles: Option<Vec<f64>> = candidates.iter().map(|c| c.angle_deg).collect();
    let angles = angles?;
    let direction = (angles.last()? - angles.first()?).signum();
    let back = |pair: &[f64]| (pair[1] - pair[0]) * direction < -1.0;
    let at = angles.windows(2).position(back)?;
    Some(candidates[at + 1].frame)
}

/// A gap in the time stamps, where frames seem to be missing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct TimeGap {
    /// The frame after the gap.
    pub(super) before: u64,
    /// Number of frames that would fit into it.
    pub(super) missing: u64,
}

/// Finds gaps in the time stamps: neighbours more than 1.5 median steps apart.
pub(super) fn time_gaps(candidates: &[Candidate]) -> Vec<TimeGap> {
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
            (SamplingBasis::Time, SamplingBasis::Angle)
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
        // Frames after the gaps keep their own position in the turn.
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
    fn half_a_turn_makes_the_samples_that_are_there_and_no_others() {
        let angles = (0..750).map(|n| f64::from(n) * 0.24);
        let selection = Selection::choose(&turned(angles), 1500).unwrap();
        assert!(selection.is_partial());
        assert!((selection.covered_deg().unwrap() - 180.0).abs() < 1e-6);
        assert_eq!(selection.frames, (0..750).collect::<Vec<u64>>());
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
    fn a_table_that_does_not_turn_is_refused() {
        let candidates = turned((0..100).map(|n| f64::from(n) * 1e-4));
        let error = Selection::choose(&candidates, 100).unwrap_err();
        assert!(matches!(error, ExtractError::TableStands { .. }), "{error}");
    }

    #[test]
    fn an_angle_that_goes_back_is_found() {
        let angles =
            |wrong: f64| (0..150).map(move |n| if n == 50 { wrong } else { 2.4 * f64::from(n) });
        assert_eq!(reversal_frame(&turned(angles(0.0))), Some(50));
        assert_eq!(reversal_frame(&turned(angles(120.0))), None);
        let backwards = angles(120.0).map(|angle| -angle);
        assert_eq!(reversal_frame(&turned(backwards)), None);
    }

    #[test]
    fn a_repeated_angle_shifts_no_other_sample() {
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
        let span = TurnSpan::from_candidates(&candidates).unwrap();
        let again = Selection::among(&candidates[10..], span, 150).unwrap();
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
                let position = |t_us: i64| (t_us - candidates[0].t_us) as f64;
                let target = f64::from(k) * selection.span.extent / f64::from(samples);
                let distance = (position(candidates[*frame as usize].t_us) - target).abs();
                let others = candidates.iter().map(|c| (position(c.t_us) - target).abs());
                prop_assert!(distance <= others.fold(f64::INFINITY, f64::min));
            }
        }
    }
}
