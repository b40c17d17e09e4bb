//! What is to be made of one video: which source frame serves which samples.

use std::collections::{BTreeMap, HashSet};

use super::pipeline::Lost;
use super::select::{Candidate, Selection};
use super::{Error, time_gaps};
use crate::session::FrameIndex;
use crate::video::Video;

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
        let whole = video.frames().iter().filter(|frame| !frame.damaged);
        let mut candidates: Vec<Candidate> = match index {
            None => whole
                .map(|frame| Candidate {
                    frame: frame.number,
                    t_us: frame.t_us,
                    angle_deg: None,
                })
                .collect(),
            // A frame beyond the index has no time stamp on the driver's clock: it is left out.
            Some(index) => whole
                .filter_map(|frame| {
                    let entry = index.entries().get(usize::try_from(frame.number).ok()?)?;
                    let (t_us, angle_deg) = (entry.t_us, entry.angle_deg);
                    Some(Candidate {
                        frame: frame.number,
                        t_us,
                        angle_deg,
                    })
                })
                .collect(),
        };
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

    /// The samples that each source frame serves.
    pub(super) fn uses(&mut self) -> Uses {
        let chosen = (0..).zip(self.selection.frames.clone());
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
        let again = Selection::choose(&self.candidates, self.samples)?;
        let mut chosen = Vec::new();
        for (index, (frame, other)) in (0..).zip(self.selection.frames.iter_mut().zip(again.frames))
        {
            if lost.contains(frame) {
                *frame = other;
                chosen.push((index, other));
            }
        }
        Ok(self.note(chosen))
    }

    fn note(&mut self, chosen: Vec<(u32, u64)>) -> Uses {
        let mut uses = Uses::new();
        for (index, frame) in chosen {
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
