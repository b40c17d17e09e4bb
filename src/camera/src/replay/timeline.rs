//! Times and counters of a recording's frames.

use relit_data::session::FrameIndex;
use relit_video::FrameInfo;

/// Counter and time of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct FrameTime {
    /// The driver's counter, which continues if the recording repeats.
    pub(super) sequence: u64,
    /// Time since the recording's first frame, microseconds.
    pub(super) since_first_us: i64,
}

/// Counters and times of all frames of a video; not empty, both increase.
#[derive(Debug)]
pub(super) struct Timeline {
    moments: Vec<FrameTime>,
}

impl Timeline {
    /// From the frame index, which has the camera's own; frames after its end, and all frames without
    /// an index, are counted on and have the video's times.
    pub(super) fn new(index: Option<&FrameIndex>, frames: &[FrameInfo]) -> Self {
        let entries = index.map(FrameIndex::entries).unwrap_or_default();
        let mut moments: Vec<FrameTime> = Vec::with_capacity(frames.len());
        let first_us = entries.first().map_or(0, |entry| entry.t_us);
        for (at, frame) in frames.iter().enumerate() {
            let moment = match (entries.get(at), moments.last()) {
                (Some(entry), _) => FrameTime {
                    sequence: entry.sequence,
                    since_first_us: entry.t_us.saturating_sub(first_us),
                },
                (None, None) => FrameTime {
                    sequence: 0,
                    since_first_us: 0,
                },
                (None, Some(last)) => {
                    // Frames without times, or with equal ones, still have increasing times here.
                    let step = frame.t_us.saturating_sub(frames[at - 1].t_us).max(1);
                    FrameTime {
                        sequence: last.sequence.saturating_add(1),
                        since_first_us: last.since_first_us.saturating_add(step),
                    }
                }
            };
            moments.push(moment);
        }
        Self { moments }
    }

    pub(super) fn len(&self) -> usize {
        self.moments.len()
    }

    /// The mean time from one frame to the next, microseconds, at least 1; a 30th of a second if
    /// there is only one frame.
    pub(super) fn period_us(&self) -> i64 {
        match self.moments.as_slice() {
            [first, .., last] => {
                let counted = last.sequence.saturating_sub(first.sequence).max(1);
                let counted = i64::try_from(counted).unwrap_or(i64::MAX);
                (last.since_first_us / counted).max(1)
            }
            _ => 33_333,
        }
    }

    /// The moment of a frame in the given repetition. After the last frame comes the first, one
    /// period later and counted on by one.
    pub(super) fn moment(&self, number: u64, round: u64) -> FrameTime {
        let at = usize::try_from(number).unwrap_or(usize::MAX);
        let ends = self.moments.first().zip(self.moments.last());
        let Some((found, (first, last))) = self.moments.get(at).zip(ends) else {
            return FrameTime {
                sequence: number,
                since_first_us: 0,
            };
        };
        let count = last
            .sequence
            .saturating_sub(first.sequence)
            .saturating_add(1);
        let length = last.since_first_us.saturating_add(self.period_us());
        let rounds = i64::try_from(round).unwrap_or(i64::MAX);
        FrameTime {
            sequence: found.sequence.saturating_add(round.saturating_mul(count)),
            since_first_us: found
                .since_first_us
                .saturating_add(rounds.saturating_mul(length)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relit_data::session::FrameEntry;

    fn frames(times: &[i64]) -> Vec<FrameInfo> {
        let frames = times.iter().zip(0..);
        frames
            .map(|(&t_us, number)| FrameInfo {
                number,
                t_us,
                damaged: false,
            })
            .collect()
    }

    fn index(entries: &[(u64, i64)]) -> FrameIndex {
        let mut index = FrameIndex::default();
        for (&(sequence, t_us), n) in entries.iter().zip(0..) {
            let entry = FrameEntry {
                n,
                sequence,
                t_us,
                angle_deg: None,
            };
            index.push(entry).unwrap();
        }
        index
    }

    fn moments(timeline: &Timeline, round: u64) -> Vec<(u64, i64)> {
        (0..timeline.len() as u64)
            .map(|number| timeline.moment(number, round))
            .map(|moment| (moment.sequence, moment.since_first_us))
            .collect()
    }

    #[test]
    fn the_index_counts_and_a_repetition_counts_on() {
        let index = index(&[(5, 1000), (6, 1100), (9, 1400)]);
        let timeline = Timeline::new(Some(&index), &frames(&[0, 1, 2]));
        assert_eq!(moments(&timeline, 0), [(5, 0), (6, 100), (9, 400)]);
        assert_eq!(timeline.period_us(), 100);
        assert_eq!(moments(&timeline, 1), [(10, 500), (11, 600), (14, 900)]);
    }

    #[test]
    fn frames_beyond_the_index_have_the_video_s_times() {
        let index = index(&[(5, 1000)]);
        let timeline = Timeline::new(Some(&index), &frames(&[0, 40, 80]));
        assert_eq!(moments(&timeline, 0), [(5, 0), (6, 40), (7, 80)]);
        let bare = Timeline::new(None, &frames(&[70, 90, 90]));
        assert_eq!(moments(&bare, 0), [(0, 0), (1, 20), (2, 21)]);
    }

    #[test]
    fn no_recording_is_too_short_or_too_long() {
        let one = Timeline::new(None, &frames(&[0]));
        assert_eq!(moments(&one, 2), [(2, 66_666)]);
        one.moment(u64::MAX, u64::MAX);
        let far = index(&[(0, i64::MIN), (u64::MAX, i64::MAX)]);
        let far = Timeline::new(Some(&far), &frames(&[0, 1]));
        far.moment(1, u64::MAX);
    }
}
