//! What is to be made of one video: which source frame serves which samples.

use std::collections::{BTreeMap, HashSet};

use super::pipeline::Lost;
use super::select::{Candidate, Selection};
use super::timeline::timeline;
use super::{Error, runs_back_at, time_gaps};
use relit_data::session::FrameIndex;
use relit_video::Video;

/// The frames of a video that may be chosen, and what was chosen among them.
#[derive(Debug)]
pub(super) struct Plan {
    samples: u32,
    candidates: Vec<Candidate>,
    without_angle: usize,
    /// Source frames that already stand in a sample that is no duplicate.
    taken: HashSet<u64>,
    pub(super) selection: Selection,
}

/// One sample that a source frame serves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Use {
    pub(super) index: u32,
    /// Another sample has the same source frame, and is not flagged.
    pub(super) duplicate: bool,
}

/// A sample and the frame that was chosen for it.
struct Place {
    index: u32,
    frame: u64,
    off_by: f64,
}

/// The samples that each source frame serves.
pub(super) type Uses = BTreeMap<u64, Vec<Use>>;

impl Plan {
    /// Chooses `samples` frames among those that are whole as far as the container knows, with the
    /// driver's time stamps and angles where the session has them.
    pub(super) fn new(
        video: &Video,
        index: Option<&FrameIndex>,
        samples: u32,
    ) -> Result<Self, Error> {
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
            taken: HashSet::new(),
            selection,
        })
    }

    /// What is known of a frame that was chosen.
    pub(super) fn candidate(&self, frame: u64) -> Option<&Candidate> {
        let at = self
            .candidates
            .binary_search_by_key(&frame, |c| c.frame)
            .ok()?;
        self.candidates.get(at)
    }

    /// How many frames may be chosen.
    pub(super) fn usable(&self) -> usize {
        self.candidates.len()
    }

    /// How many samples repeat a source frame.
    pub(super) fn repeated(&self) -> usize {
        let frames: HashSet<&u64> = self.selection.frames.iter().collect();
        self.selection.frames.len() - frames.len()
    }

    /// How many frames are left out because they alone have no angle; `None` where there are none.
    pub(super) fn without_angle(&self) -> Option<usize> {
        (self.without_angle > 0).then_some(self.without_angle)
    }

    /// The frame at which the angle runs back, if it does.
    pub(super) fn runs_back_at(&self) -> Option<u64> {
        runs_back_at(&self.candidates)
    }

    /// The samples that each source frame serves.
    pub(super) fn uses(&mut self) -> Uses {
        let Selection { frames, off_by, .. } = &self.selection;
        let places = (0..).zip(frames.iter().zip(off_by));
        let chosen = places.map(|(index, (&frame, &off_by))| Place {
            index,
            frame,
            off_by,
        });
        self.note(chosen.collect())
    }

    /// Chooses again for the samples whose frames turned out to be damaged, among the others; the
    /// samples that have a frame keep it. Answers the samples that each further frame serves:
    /// none, where nothing is lost.
    pub(super) fn replace(&mut self, lost: &[Lost]) -> Result<Uses, Error> {
        if lost.is_empty() {
            return Ok(Uses::new());
        }
        let lost: HashSet<u64> = lost.iter().map(|frame| frame.number).collect();
        self.candidates
            .retain(|candidate| !lost.contains(&candidate.frame));
        let again = Selection::among(&self.candidates, self.selection.turn(), self.samples)?;
        let mut chosen = Vec::new();
        for (index, (frame, &off_by)) in (0_u32..).zip(again.frames.iter().zip(&again.off_by)) {
            let kept = &mut self.selection.frames[index as usize];
            if lost.contains(kept) {
                *kept = *frame;
                chosen.push(Place {
                    index,
                    frame: *frame,
                    off_by,
                });
            }
        }
        Ok(self.note(chosen))
    }

    /// Of the samples of one source frame, the one whose place is nearest to the frame's own is
    /// the original, and the others are duplicates.
    fn note(&mut self, mut chosen: Vec<Place>) -> Uses {
        chosen.sort_by(|a, b| a.off_by.total_cmp(&b.off_by).then(a.index.cmp(&b.index)));
        let mut uses = Uses::new();
        for Place { index, frame, .. } in chosen {
            let duplicate = !self.taken.insert(frame);
            uses.entry(frame)
                .or_default()
                .push(Use { index, duplicate });
        }
        uses
    }

    /// One sentence for every gap in the time stamps.
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
