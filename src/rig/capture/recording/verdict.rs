//! What a take is worth, and closing its session.

use std::mem::discriminant;

use super::cutter::TurnCount;
use super::error::RecordingError;
use super::outcome::{CameraOutcome, End, FrameIssue, WriterOutcome};
use super::salvage::whole_frames;
use super::timing::{Evidence, TimingAnomaly};
use crate::state::{TakeSummary, Verdict};
use relit_data::causes::with_causes;
use relit_data::session::{Fault, FrameEntry};

/// Largest angle that can be right, degrees.
const MOST_DEGREES: f64 = 1e6;
/// Most faults of one kind that the manifest lists.
const MOST_LISTED: usize = 40;

/// A recording that has ended, and whose session is not closed yet.
pub struct Recorded {
    camera: CameraOutcome,
    writer: WriterOutcome,
    max_dropped: u64,
}

impl Recorded {
    pub(super) fn new(camera: CameraOutcome, writer: WriterOutcome, max_dropped: u64) -> Self {
        Self {
            camera,
            writer,
            max_dropped,
        }
    }

    /// Why it ended.
    #[must_use]
    pub fn end(&self) -> &End {
        &self.camera.end
    }

    /// Notes that something other than the recorder ended the take, which is unusable then, for
    /// this reason.
    pub fn interrupted(&mut self, reason: String) {
        self.camera.end = End::Interrupted(reason);
    }

    /// Judges the take and closes its session. Each frame gets the angle (degrees) that `angle`
    /// returns for its time stamp (microseconds). `control_faults`: what is no longer as it was set
    /// on the camera, a sentence each.
    ///
    /// # Errors
    /// What closing the session answers; its status stays "recording" then, and it can be salvaged.
    pub fn finish(
        mut self,
        angle: &dyn Fn(i64) -> Option<f64>,
        control_faults: &[String],
    ) -> Result<TakeSummary, RecordingError> {
        if self.writer.failure.is_some() {
            // The video could not be closed: what the disk has of it decides.
            let session = &mut self.writer.session;
            session.truncate(whole_frames(&session.video_path()));
            let frames = session.index().entries().len();
            self.writer.delivered.truncate(frames);
        }
        let issues = self.issues();
        let losses = issues.iter().filter(|(_, issue)| issue.is_loss()).count();
        let lost = self.camera.count.missing_count() + losses as u64;
        let damaged = (issues.len() - losses) as u64;
        let faults = self.faults(&issues, control_faults);
        let (verdict, reason) = match self.rejection(lost, damaged, &issues, control_faults) {
            Some(reason) => (Verdict::Aborted, Some(reason)),
            None if faults.is_empty() => (Verdict::Clean, None),
            None => (
                Verdict::Tolerated,
                faults.first().map(|fault| fault.what.clone()),
            ),
        };
        let note = self.lead_note();
        let (frames, count) = (self.recorded(), &self.camera.count);
        let WriterOutcome {
            mut session,
            delivered,
            ..
        } = self.writer;
        session.amend(|entry| amended(entry, count, &delivered, angle))?;
        session
            .manifest_mut()
            .faults
            .extend(note.into_iter().chain(faults));
        let manifest = match (verdict, &reason) {
            (Verdict::Aborted, Some(reason)) => session.abort(reason)?,
            _ => session.finish()?,
        };
        Ok(TakeSummary {
            session: manifest.id,
            verdict,
            frames,
            dropped: lost,
            reason,
        })
    }

    /// Frames of the turn in the video.
    fn recorded(&self) -> u64 {
        self.writer.delivered.iter().flatten().count() as u64
    }

    /// What is wrong with delivered frames, by kind and then by frame. Frames that came after the
    /// turn's last exposure do not count.
    fn issues(&self) -> Vec<(usize, FrameIssue)> {
        let left_out = self.writer.left_out.iter();
        let left_out = left_out.map(|&delivered| (delivered, FrameIssue::Unusable));
        let issues = self.camera.issues.iter().copied().chain(left_out);
        let frames = self.camera.count.exposures.len();
        let mut issues: Vec<_> = issues.filter(|&(at, _)| at < frames).collect();
        let kind = |issue| match issue {
            FrameIssue::QueueFull => 0,
            FrameIssue::Unusable => 1,
            FrameIssue::Damaged(_) => 2,
        };
        issues.sort_by_key(|&(at, issue)| (kind(issue), at));
        issues
    }

    /// Why the take cannot be used; `None` where it can.
    fn rejection(
        &self,
        lost: u64,
        damaged: u64,
        issues: &[(usize, FrameIssue)],
        control_faults: &[String],
    ) -> Option<String> {
        let TurnCount {
            expected,
            missing,
            anomalies,
            ..
        } = &self.camera.count;
        if let Some(failure) = &self.writer.failure {
            return Some(self.disk_failure(failure));
        }
        // A recording that ended early, but after the turn's last frame, is whole.
        let last = missing.last().map(|last| last.exposure + last.count);
        let whole = *expected > 0 && last.is_none_or(|end| end < *expected);
        let end = with_causes(&self.camera.end);
        match self.camera.end {
            End::Over => {}
            End::Interrupted(_) => return Some(self.ended_early(&end)),
            _ if !whole => return Some(self.ended_early(&end)),
            _ => {}
        }
        if let Some(fault) = control_faults.first() {
            return Some(fault.clone());
        }
        let is_rate = |anomaly: &&TimingAnomaly| matches!(anomaly, TimingAnomaly::Rate { .. });
        if let Some(rate) = anomalies.iter().find(is_rate) {
            return Some(rate.to_string());
        }
        (lost + damaged > self.max_dropped).then(|| self.too_many(lost, damaged, issues))
    }

    fn ended_early(&self, end: &str) -> String {
        match self.camera.count.expected {
            0 => format!("{end}; the turn had not begun"),
            all => format!("{end}; {} of {all} frames are there", self.recorded()),
        }
    }

    fn too_many(&self, lost: u64, damaged: u64, issues: &[(usize, FrameIssue)]) -> String {
        let mut parts = Vec::new();
        if lost > 0 {
            let mut part = format!("{} lost", frames(lost));
            if let Some(first) = self.camera.count.missing.first() {
                part += &format!(" (the camera dropped exposure {} first)", first.exposure);
            }
            let slow = issues
                .iter()
                .filter(|(_, issue)| *issue == FrameIssue::QueueFull);
            match slow.count() as u64 {
                0 => {}
                slow => {
                    part += &format!(", {} of them because the disk was too slow", frames(slow))
                }
            }
            parts.push(part);
        }
        if damaged > 0 {
            parts.push(format!("{} damaged", frames(damaged)));
        }
        let found = parts.join(" and ");
        format!("{found}, where {} are allowed", self.max_dropped)
    }

    /// Why the disk took no more, and how much more the turn would have needed.
    fn disk_failure(&self, failure: &RecordingError) -> String {
        if !failure.is_out_of_space() {
            return with_causes(failure);
        }
        let pending = match failure {
            RecordingError::Video(relit_video::VideoError::NoRoom { missing, .. }) => *missing,
            _ => 0,
        };
        let recorded = self.recorded();
        let left = self.camera.count.expected.saturating_sub(recorded);
        let mean_bytes = self.writer.bytes / recorded.max(1);
        let missing = pending.saturating_add(left.saturating_mul(mean_bytes));
        format!(
            "the disk is full: in {} about {missing} bytes are missing for the rest of the turn ({})",
            self.writer.session.folder().display(),
            frames(left)
        )
    }

    /// Frames before the turn, which are no fault.
    fn lead_note(&self) -> Option<Fault> {
        let first = self.writer.session.index().entries().first()?;
        let lead = lead_of(&self.writer.delivered);
        (lead > 0).then(|| Fault {
            t_us: first.t_us,
            what: format!(
                "{} before the turn are in the video, as its frames build on them",
                frames(lead)
            ),
        })
    }

    /// What is wrong with the take, in order of kind and place.
    fn faults(&self, issues: &[(usize, FrameIssue)], control_faults: &[String]) -> Vec<Fault> {
        let entries = self.writer.session.index().entries();
        let last_us = entries.last().map_or(0, |entry| entry.t_us);
        let fault = |t_us, what| Fault { t_us, what };
        // The frame of the video that is the delivered one, or comes after it.
        let frame_at = |delivered: usize| {
            let mut frames = self.writer.delivered.iter();
            let found = frames.position(|&at| at >= Some(delivered));
            found.unwrap_or(entries.len())
        };
        let time_of = |n: usize| entries.get(n).map_or(last_us, |entry| entry.t_us);
        let count = &self.camera.count;
        let missing = count.missing.iter().map(|missing| {
            let (n, frames) = (frame_at(missing.before), frames(missing.count));
            let evidence = in_words(missing.evidence);
            fault(
                time_of(n),
                format!("{frames} missing before frame {n}, {evidence}"),
            )
        });
        let mut faults = first_of(missing, last_us);
        for issues in
            issues.chunk_by(|(_, one), (_, other)| discriminant(one) == discriminant(other))
        {
            let of_kind = issues.iter().map(|&(delivered, issue)| {
                let n = frame_at(delivered);
                fault(time_of(n), issue.at(n))
            });
            faults.extend(first_of(of_kind, last_us));
        }
        let anomalies = count
            .anomalies
            .iter()
            .map(|anomaly| fault(last_us, anomaly.to_string()));
        faults.extend(first_of(anomalies, last_us));
        let controls = control_faults
            .iter()
            .map(|what| fault(last_us, what.clone()));
        faults.extend(first_of(controls, last_us));
        faults
    }
}

/// A frame's entry with its angle, and with the number of its exposure where the driver's counter
/// does not count.
fn amended(
    entry: &FrameEntry,
    count: &TurnCount,
    delivered: &[Option<usize>],
    angle: &dyn Fn(i64) -> Option<f64>,
) -> FrameEntry {
    let place = usize::try_from(entry.n).ok();
    let place = place.and_then(|n| *delivered.get(n)?);
    let sequence = match place.and_then(|place| count.exposures.get(place)) {
        _ if count.counts => entry.sequence,
        Some(exposure) => lead_of(delivered) + exposure,
        None => entry.n,
    };
    let possible = |angle: &f64| (-MOST_DEGREES..=MOST_DEGREES).contains(angle);
    FrameEntry {
        sequence,
        angle_deg: angle(entry.t_us).filter(possible),
        ..*entry
    }
}

/// Frames of the video before the turn.
fn lead_of(delivered: &[Option<usize>]) -> u64 {
    delivered.iter().take_while(|at| at.is_none()).count() as u64
}

/// Faults of one kind; only the first of them if they are many.
fn first_of(kind: impl ExactSizeIterator<Item = Fault>, last_us: i64) -> Vec<Fault> {
    let more = kind.len().saturating_sub(MOST_LISTED);
    let mut faults: Vec<Fault> = kind.take(MOST_LISTED).collect();
    if more > 0 {
        let what = format!("and {more} more of this kind");
        faults.push(Fault {
            t_us: last_us,
            what,
        });
    }
    faults
}

fn in_words(evidence: Evidence) -> &'static str {
    match evidence {
        Evidence::Both => "by the driver's counter and the time stamps",
        Evidence::Counter => "by the driver's counter",
        Evidence::Time => "by the time stamps",
        Evidence::TimeAgainstCounter => "by the time stamps, though the driver did not count them",
    }
}

fn frames(count: u64) -> String {
    match count {
        1 => "1 frame".to_owned(),
        _ => format!("{count} frames"),
    }
}
