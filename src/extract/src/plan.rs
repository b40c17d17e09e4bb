//! Which source frame is used for which samples.

use std::collections::{BTreeMap, HashSet};
use std::ops::Range;

use relit_data::session::FrameIndex;
use relit_data::shard::SamplingBasis;
use relit_video::Video;

use super::ExtractError;
use super::select::{Candidate, Selection, reversal_frame, time_gaps};
use super::timeline::timeline;

/// The frames of a video that may be chosen, and those that were chosen.
#[derive(Debug)]
pub(super) struct Plan {
    samples: u32,
    candidates: Vec<Candidate>,
    without_angle: usize,
    /// Source frames that are already used in a sample that is not a duplicate.
    used: HashSet<u64>,
    pub(super) selection: Selection,
}

/// A sample to which a source frame is assigned.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Assignment {
    /// Index of the sample.
    pub(super) index: u32,
    /// True if another sample has the same source frame and is not flagged.
    pub(super) duplicate: bool,
}

/// A sample and the frame that was chosen for it.
struct Choice {
    index: u32,
    frame: u64,
    distance: f64,
}

/// The samples to which each source frame is assigned.
pub(super) type Assignments = BTreeMap<u64, Vec<Assignment>>;

impl Plan {
    /// Chooses `samples` frames among those that are not damaged as far as the container shows, with
    /// the driver's time stamps and angles if the session has them.
    pub(super) fn new(
        video: &Video,
        index: Option<&FrameIndex>,
        samples: u32,
    ) -> Result<Self, ExtractError> {
        let mut candidates = timeline(video.frames(), index)?;
        let all = candidates.len();
        if candidates
            .iter()
            .any(|candidate| candidate.angle_deg.is_some())
        {
            candidates.retain(|candidate| candidate.angle_deg.is_some());
        }
        let without_angle = all - candidates.len();
        let selection = Selection::choose(&candidates, samples)?;
        Ok(Self {
            samples,
            candidates,
            without_angle,
            used: HashSet::new(),
            selection,
        })
    }

    /// Time stamp and angle of a frame that was chosen.
    pub(super) fn candidate(&self, frame: u64) -> Option<&Candidate> {
        let at = self
            .candidates
            .binary_search_by_key(&frame, |c| c.frame)
            .ok()?;
        self.candidates.get(at)
    }

    /// Whether any frame has an angle.
    pub(super) fn has_angles(&self) -> bool {
        self.selection.basis() == SamplingBasis::Angle
    }

    /// From the first frame to the last, seconds.
    pub(super) fn seconds(&self) -> f64 {
        match self.candidates.as_slice() {
            [first, .., last] => last.t_us.saturating_sub(first.t_us) as f64 / 1e6,
            _ => 0.0,
        }
    }

    /// Number of frames that may be chosen.
    pub(super) fn usable(&self) -> usize {
        self.candidates.len()
    }

    /// Number of samples that repeat a source frame.
    pub(super) fn repeated(&self) -> usize {
        let frames: HashSet<&u64> = self.selection.frames.iter().collect();
        self.selection.frames.len() - frames.len()
    }

    /// Number of frames that are left out because they have no angle although others have one;
    /// `None` if there are none.
    pub(super) fn without_angle(&self) -> Option<usize> {
        (self.without_angle > 0).then_some(self.without_angle)
    }

    /// The frame at which the angle goes backwards, if there is one.
    pub(super) fn reversal_frame(&self) -> Option<u64> {
        reversal_frame(&self.candidates)
    }

    /// The samples to which each chosen frame is assigned.
    pub(super) fn assignments(&mut self) -> Assignments {
        let Selection {
            frames, distances, ..
        } = &self.selection;
        let chosen = (0..).zip(frames.iter().zip(distances));
        let chosen = chosen.map(|(index, (&frame, &distance))| Choice {
            index,
            frame,
            distance,
        });
        self.assign(chosen.collect())
    }

    /// Chooses again, without the frames `lost`, for the samples to which these were assigned. The
    /// other samples keep their frames. Frames that were not tried are left out, too, if they are `doubtful`. Returns the new
    /// assignments; none if nothing is lost.
    pub(super) fn replace(
        &mut self,
        lost: &HashSet<u64>,
        doubtful: &[Range<u64>],
    ) -> Result<Assignments, ExtractError> {
        if lost.is_empty() {
            return Ok(Assignments::new());
        }
        let used = &self.used;
        let is_doubtful = |frame: &u64| doubtful.iter().any(|range| range.contains(frame));
        self.candidates.retain(|Candidate { frame, .. }| {
            !lost.contains(frame) && (used.contains(frame) || !is_doubtful(frame))
        });
        let again = Selection::among(&self.candidates, self.selection.span(), self.samples)?;
        let mut chosen = Vec::new();
        let new = again.frames.iter().zip(&again.distances);
        for (index, (&frame, &distance)) in (0_u32..).zip(new) {
            let current = &mut self.selection.frames[index as usize];
            if lost.contains(current) {
                *current = frame;
                chosen.push(Choice {
                    index,
                    frame,
                    distance,
                });
            }
        }
        Ok(self.assign(chosen))
    }

    /// Of the samples of one source frame, the one whose position in the turn is nearest to the
    /// frame's is the original, and the others are duplicates.
    fn assign(&mut self, mut chosen: Vec<Choice>) -> Assignments {
        chosen.sort_by(|a, b| {
            a.distance
                .total_cmp(&b.distance)
                .then(a.index.cmp(&b.index))
        });
        let mut assignments = Assignments::new();
        for Choice { index, frame, .. } in chosen {
            let duplicate = !self.used.insert(frame);
            let samples = assignments.entry(frame).or_default();
            samples.push(Assignment { index, duplicate });
        }
        assignments
    }

    /// One warning for every gap in the time stamps.
    pub(super) fn gap_warnings(&self) -> Vec<String> {
        let gaps = time_gaps(&self.candidates);
        gaps.iter()
            .map(|gap| {
                let before = gap.before;
                match gap.missing {
                    1 => {
                        format!("the time stamps have room for 1 more frame before frame {before}")
                    }
                    n => format!(
                        "the time stamps have room for {n} more frames before frame {before}"
                    ),
                }
            })
            .collect()
    }
}
