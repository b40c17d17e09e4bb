//! What a take is worth, and the end of its session.

use std::fmt::Write;
use std::path::PathBuf;
use std::time::Duration;

use super::salvage::whole_frames;
use super::sink::Sunk;
use super::trace::{Doubt, Missing};
use super::{Count, Error};
use crate::camera::{CameraError, FrameFault};
use relit_data::session::{Fault, FrameEntry, Manifest, SessionWriter};

/// Largest angle that is believed, degrees.
const MOST_DEGREES: f64 = 1e6;

/// Why a recording ended.
#[derive(Debug, thiserror::Error)]
pub enum End {
    /// The turn is over.
    #[error("the turn is over")]
    Over,
    /// It was asked to stop.
    #[error("it was stopped before the turn was over")]
    Stopped,
    /// The camera failed.
    #[error("{0}")]
    Camera(CameraError),
    /// The camera fell silent.
    #[error("the camera gave no frame for {:.1} s: check its cable", .waited.as_secs_f64())]
    Stalled {
        /// How long was waited.
        waited: Duration,
    },
    /// The camera delivers another size than agreed.
    #[error("the camera changed what it delivers: {0}")]
    OtherSize(FrameFault),
    /// The disk took no more.
    #[error("the disk took no more")]
    Disk,
    /// A replayed recording is over.
    #[error("the recording that plays the camera is over")]
    SourceOver,
    /// Something that is not the recorder's ended the take: the table, or somebody's wish.
    #[error("{0}")]
    Elsewhere(String),
}

/// A frame that came damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Damaged {
    /// Its place among the delivered frames of the turn, from 0.
    pub delivered: usize,
    /// What is wrong with it.
    pub fault: FrameFault,
}

/// What a take is worth.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Take {
    /// Whole, and nothing to say of it.
    Clean,
    /// Whole but for what was allowed, and for what its manifest tells.
    Tolerated,
    /// Not to be used, for this reason; what was recorded is kept, marked as aborted.
    Bad {
        /// Why, for a person.
        reason: String,
    },
}

/// A recording that has ended and is closed.
#[derive(Debug)]
pub struct Report {
    /// What it is worth.
    pub take: Take,
    /// The session folder.
    pub folder: PathBuf,
    /// The manifest as written.
    pub manifest: Manifest,
    /// Exposures of the turn, by the camera's own rate.
    pub expected: u64,
    /// Frames of the turn in the video.
    pub recorded: u64,
    /// What the camera did not deliver.
    pub missing: Vec<Missing>,
    /// Exposures that were delivered and not recorded, as the disk was too slow.
    pub overrun: Vec<u64>,
    /// Exposures that were delivered and could not be recorded: empty, or before any key frame.
    pub left_out: Vec<u64>,
    /// Frames that came damaged.
    pub damaged: Vec<Damaged>,
    /// What does not fit otherwise.
    pub doubts: Vec<Doubt>,
}

/// What is known at the end, before it is judged.
pub(super) struct Verdict {
    pub(super) max_dropped: u64,
    pub(super) count: Count,
    pub(super) damaged: Vec<Damaged>,
    pub(super) overrun: Vec<usize>,
    pub(super) empty: Vec<usize>,
}

impl Verdict {
    /// Judges the take and closes its session.
    pub(super) fn close(
        mut self,
        end: End,
        sunk: Sunk,
        angle: &dyn Fn(i64) -> Option<f64>,
        moved: &[String],
    ) -> Result<Report, Error> {
        self.keep_to_the_turn();
        let Sunk {
            mut session,
            mut places,
            left_out,
            bytes,
            failure,
        } = sunk;
        if failure.is_some() {
            // The video could not be ended: what the disk has of it decides.
            session.truncate(whole_frames(&session.video_path()));
            places.truncate(session.index().entries().len());
        }
        let recorded = places.iter().flatten().count() as u64;
        let mut left_out = [&self.empty[..], &left_out].concat();
        left_out.sort_unstable();
        let lost = self.count.missing_count() + (self.overrun.len() + left_out.len()) as u64;
        let why = Why {
            end: &end,
            failure: failure.as_ref(),
            lost,
            moved,
            folder: session.folder(),
            mean_bytes: bytes / recorded.max(1),
            recorded,
        };
        let take = self.judge(&why);
        let faults = self.faults(&session, &places, &left_out, moved);
        let folder = session.folder().to_owned();
        let amended = |entry: &FrameEntry| self.amended(&places, entry, angle);
        let manifest = close_session(session, &take, faults, amended)?;
        let exposure = |places: &[usize]| -> Vec<u64> {
            let exposures = places.iter().filter_map(|&at| self.count.exposures.get(at));
            exposures.copied().collect()
        };
        Ok(Report {
            take,
            folder,
            manifest,
            expected: self.count.expected,
            recorded,
            overrun: exposure(&self.overrun),
            left_out: exposure(&left_out),
            missing: self.count.missing,
            damaged: self.damaged,
            doubts: self.count.doubts,
        })
    }

    /// Frames that came after the turn's last exposure do not count.
    fn keep_to_the_turn(&mut self) {
        let frames = self.count.exposures.len();
        self.damaged.retain(|damaged| damaged.delivered < frames);
        self.overrun.retain(|&at| at < frames);
        self.empty.retain(|&at| at < frames);
    }

    fn judge(&self, why: &Why<'_>) -> Take {
        let bad = |reason| Take::Bad { reason };
        if let Some(failure) = why.failure {
            return bad(why.disk(failure, self.count.expected));
        }
        // A recording that ended early, but not too early, is whole.
        let whole = self.count.expected > 0
            && self
                .count
                .missing
                .last()
                .is_none_or(|last| last.exposure + last.count < self.count.expected);
        let elsewhere = matches!(why.end, End::Elsewhere(_));
        if elsewhere || !(matches!(why.end, End::Over) || whole) {
            let (has, all) = (why.recorded, self.count.expected);
            return bad(match all {
                0 => format!("{}; the turn had not begun", why.end),
                _ => format!("{}; {has} of {all} frames are there", why.end),
            });
        }
        if let Some(moved) = why.moved.first() {
            return bad(moved.clone());
        }
        let rate = self
            .count
            .doubts
            .iter()
            .find(|doubt| matches!(doubt, Doubt::Rate { .. }));
        if let Some(rate) = rate {
            return bad(rate.to_string());
        }
        let spoilt = why.lost + self.damaged.len() as u64;
        if spoilt > self.max_dropped {
            return bad(self.too_many(why.lost));
        }
        if spoilt == 0 && self.count.doubts.is_empty() {
            return Take::Clean;
        }
        Take::Tolerated
    }

    fn too_many(&self, lost: u64) -> String {
        let mut reason = String::new();
        // Writing to a string does not fail.
        if lost > 0 {
            let _ = write!(reason, "{} lost", frames(lost));
            if let Some(first) = self.count.missing.first() {
                let _ = write!(
                    reason,
                    " (the camera dropped exposure {} first)",
                    first.exposure
                );
            }
            if !self.overrun.is_empty() {
                let slow = frames(self.overrun.len() as u64);
                let _ = write!(reason, ", {slow} of them because the disk was too slow");
            }
        }
        if !self.damaged.is_empty() {
            let join = if lost > 0 { " and " } else { "" };
            let _ = write!(
                reason,
                "{join}{} damaged",
                frames(self.damaged.len() as u64)
            );
        }
        let _ = write!(reason, ", where {} are allowed", self.max_dropped);
        reason
    }

    /// A frame's entry with its angle, and with the number of its exposure where the driver's
    /// counter tells nothing.
    fn amended(
        &self,
        places: &[Option<usize>],
        entry: &FrameEntry,
        angle: &dyn Fn(i64) -> Option<f64>,
    ) -> FrameEntry {
        let lead = places.iter().take_while(|place| place.is_none()).count() as u64;
        let at = usize::try_from(entry.n).ok();
        let exposure = at
            .and_then(|at| *places.get(at)?)
            .and_then(|place| self.count.exposures.get(place));
        let sequence = match exposure {
            _ if self.count.counts => entry.sequence,
            Some(exposure) => lead + exposure,
            None => entry.n,
        };
        let believed = |angle: &f64| (-MOST_DEGREES..=MOST_DEGREES).contains(angle);
        FrameEntry {
            sequence,
            angle_deg: angle(entry.t_us).filter(believed),
            ..*entry
        }
    }
}

/// What speaks for and against a take.
struct Why<'a> {
    end: &'a End,
    failure: Option<&'a Error>,
    lost: u64,
    moved: &'a [String],
    folder: &'a std::path::Path,
    mean_bytes: u64,
    recorded: u64,
}

impl Why<'_> {
    /// Why the disk took no more, and how much more the turn would have needed.
    fn disk(&self, failure: &Error, expected: u64) -> String {
        if !failure.is_no_room() {
            return failure.to_string();
        }
        let pending = match failure {
            Error::Video(relit_video::VideoError::NoRoom { missing, .. }) => *missing,
            _ => 0,
        };
        let left = expected.saturating_sub(self.recorded);
        let missing = pending.saturating_add(left.saturating_mul(self.mean_bytes));
        format!(
            "the disk is full: in {} about {missing} bytes are missing for the rest of the turn ({})",
            self.folder.display(),
            frames(left)
        )
    }
}

/// Closes the session by what the take is worth.
fn close_session(
    mut session: SessionWriter,
    take: &Take,
    faults: Vec<Fault>,
    amended: impl Fn(&FrameEntry) -> FrameEntry,
) -> Result<Manifest, Error> {
    session.amend(amended)?;
    session.manifest_mut().faults.extend(faults);
    Ok(match take {
        Take::Clean | Take::Tolerated => session.finish()?,
        Take::Bad { reason } => session.abort(reason)?,
    })
}

pub(super) fn frames(count: u64) -> String {
    match count {
        1 => "1 frame".to_owned(),
        _ => format!("{count} frames"),
    }
}
