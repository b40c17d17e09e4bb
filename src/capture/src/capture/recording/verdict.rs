//! What a take is worth, and closing its session.

use std::error::Error;

use super::error::RecordingError;
use super::finding::Finding;
use super::outcome::{CameraOutcome, EndReason, WriterOutcome};
use super::recovery::whole_frames;
use super::timing::{MissingFrames, TimingAnomaly};
use super::trimmer::TurnCount;
use crate::state::{TakeSummary, Verdict};
use relit_data::causes::with_causes;
use relit_data::counts::count_of;
use relit_data::disk::DISK_FULL;
use relit_data::session::{Fault, FrameEntry, TurnJournal, is_possible_angle};

/// Most faults of one kind that the manifest lists.
const MAX_LISTED: usize = 40;

/// A recording that has ended, and whose session is not closed yet.
pub struct FinishedRecording {
    pub(super) camera: CameraOutcome,
    pub(super) writer: WriterOutcome,
    pub(super) max_dropped: u64,
    pub(super) note: Option<String>,
}

impl FinishedRecording {
    /// Why it ended.
    pub fn end(&self) -> &EndReason {
        &self.camera.end
    }

    /// Notes that something other than the recorder ended the take, which is unusable then:
    /// [`EndReason::Interrupted`] or [`EndReason::OnPurpose`].
    pub fn ended_by(&mut self, end: EndReason) {
        self.camera.end = end;
    }

    /// Adds what a person has to know of the whole take, in a sentence; of one that cannot be used it is not kept.
    pub fn add_note(&mut self, note: String) {
        self.note = Some(note);
    }

    /// How much the light on what stands in the middle of the picture changes over the turn, as
    /// [`relit_data::turn_light`] measures it; `None` if too few frames could be looked at.
    pub fn modulation(&self) -> Option<f64> {
        let frames = usize::try_from(self.camera.count.expected).unwrap_or(usize::MAX);
        self.writer.light.modulation(frames)
    }

    /// What the table reported of the turn.
    pub fn journal(&self) -> Option<&TurnJournal> {
        self.writer.session.journal()
    }

    /// Judges the take and closes its session. Each frame gets the angle (degrees) that `angle`
    /// returns for its time stamp (microseconds). `control_faults`: the settings of the camera that
    /// changed, a sentence each.
    ///
    /// # Errors
    /// What closing the session answers; its status stays "recording" then, and it can be recovered.
    pub fn finish(
        mut self,
        angle: &dyn Fn(i64) -> Option<f64>,
        control_faults: &[String],
    ) -> Result<TakeSummary, RecordingError> {
        if self.writer.failure.is_some() {
            // The video could not be closed: what the disk has of it decides.
            let session = &mut self.writer.session;
            if let Ok(frames) = whole_frames(&session.video_path()) {
                session.truncate(frames);
            }
            let frames = session.index().entries().len();
            self.writer.delivered.truncate(frames);
        }
        let findings = self.findings(control_faults);
        let mut faults = self.faults(&findings);
        let first = faults.first().map(|fault| fault.what.clone());
        let (verdict, reason) = match (self.rejection(&findings), first) {
            (Some(reason), _) => (Verdict::Aborted, Some(reason)),
            (None, Some(first)) => (Verdict::Tolerated, Some(first)),
            (None, None) => (Verdict::Clean, None),
        };
        faults.splice(0..0, self.lead_note());
        let note = self.note.take().filter(|_| verdict != Verdict::Aborted);
        let note = note.map(|what| Fault { t_us: 0, what });
        let is_stopped = self.is_stopped();
        let (frames, count) = (self.recorded(), &self.camera.count);
        let (mut session, delivered) = (self.writer.session, self.writer.delivered);
        session.amend(|entry| amended(entry, count, &delivered, angle))?;
        let listed = &mut session.manifest_mut().faults;
        listed.splice(0..0, note);
        listed.extend(faults);
        let manifest = match (verdict, &reason) {
            (Verdict::Aborted, Some(reason)) => session.abort(reason)?,
            _ => session.finish()?,
        };
        Ok(TakeSummary {
            notes: manifest.notes(),
            session: manifest.id,
            verdict,
            frames,
            dropped: lost(&findings),
            is_stopped,
            reason,
        })
    }

    /// Frames of the turn in the video.
    fn recorded(&self) -> u64 {
        self.writer.delivered.iter().flatten().count() as u64
    }

    /// What is wrong with the take, by kind and then by frame. Frames that came after the turn's
    /// last exposure do not count.
    fn findings(&self, control_faults: &[String]) -> Vec<Finding> {
        let TurnCount {
            exposures,
            missing,
            anomalies,
            ..
        } = &self.camera.count;
        let of_turn = |finding: &&Finding| finding.place().1 < Some(exposures.len());
        let of_frames = self.camera.findings.iter().chain(&self.writer.findings);
        let mut findings: Vec<Finding> = of_frames.filter(of_turn).cloned().collect();
        // What was never due is not lost: a recording that ended early says so itself, and of a disk
        // that is full the rest of the turn is counted as one.
        let cut = self.writer.failure.is_some() || self.ended_early();
        let due = |missing: &&MissingFrames| !cut || missing.before < exposures.len();
        let missing = missing.iter().filter(due).copied().map(Finding::Missing);
        findings.extend(missing);
        findings.extend(self.unwritten(&findings));
        findings.extend(anomalies.iter().copied().map(Finding::Anomaly));
        findings.extend(control_faults.iter().cloned().map(Finding::Settings));
        findings.sort_by_key(Finding::place);
        findings
    }

    /// The turn's frames that a failed writer does not have. `findings`: what else is lost of them.
    fn unwritten(&self, findings: &[Finding]) -> Option<Finding> {
        self.writer.failure.as_ref()?;
        let last = self.writer.delivered.iter().flatten().max();
        let from = last.map_or(0, |last| last + 1);
        let count = self.left().saturating_sub(lost(findings));
        (count > 0).then_some(Finding::Unwritten { from, count })
    }

    /// Frames of the turn that are not in the video.
    fn left(&self) -> u64 {
        self.camera.count.expected.saturating_sub(self.recorded())
    }

    /// Whether the recording ended before the turn's last frame.
    fn ended_early(&self) -> bool {
        let TurnCount {
            expected, missing, ..
        } = &self.camera.count;
        // A recording that ended early, but after the turn's last frame, is whole.
        let last = missing.last().map(|last| last.exposure + last.count);
        let whole = *expected > 0 && last.is_none_or(|end| end < *expected);
        match self.camera.end {
            EndReason::Over => false,
            EndReason::Interrupted(_) | EndReason::OnPurpose(_) => true,
            _ => !whole,
        }
    }

    /// Whether nothing but a stop on purpose keeps the take from being whole.
    fn is_stopped(&self) -> bool {
        self.writer.failure.is_none() && matches!(self.camera.end, EndReason::OnPurpose(_))
    }

    /// Why the take cannot be used; `None` if it can.
    fn rejection(&self, findings: &[Finding]) -> Option<String> {
        if let Some(failure) = &self.writer.failure {
            return Some(self.disk_failure(failure));
        }
        if self.ended_early() {
            let end = with_causes(&self.camera.end);
            return Some(match self.camera.count.expected {
                0 => format!("{end}; the turn had not begun"),
                all => format!("{end}; {} of {all} frames are kept", self.recorded()),
            });
        }
        let decisive = findings.iter().find(|finding| {
            matches!(
                finding,
                Finding::Settings(_) | Finding::Anomaly(TimingAnomaly::Rate { .. })
            )
        });
        decisive
            .map(|finding| finding.text(0))
            .or_else(|| self.too_many(findings))
    }

    /// Which frames are lost or damaged, where they are more than allowed.
    fn too_many(&self, findings: &[Finding]) -> Option<String> {
        let count = |is: fn(&Finding) -> bool| findings.iter().filter(|it| is(it)).count() as u64;
        let lost = lost(findings);
        let damaged = count(|finding| matches!(finding, Finding::Damaged(..)));
        let slow = count(|finding| matches!(finding, Finding::QueueFull(_)));
        let mut found = String::new();
        if lost > 0 {
            found = format!("{} lost", count_of(lost, "frame"));
        }
        if let Some(first) = self.camera.count.missing.first() {
            found += &format!(" (the camera dropped exposure {} first)", first.exposure);
        }
        if slow > 0 {
            found += &format!(
                ", {} of them because the disk was too slow",
                count_of(slow, "frame")
            );
        }
        if damaged > 0 {
            let and = if lost > 0 { " and " } else { "" };
            found += &format!("{and}{} damaged", count_of(damaged, "frame"));
        }
        let most = self.max_dropped;
        (lost + damaged > most).then(|| format!("{found}, but only {most} are allowed"))
    }

    /// Why the disk took no more, and how much more the turn would have needed.
    fn disk_failure(&self, failure: &RecordingError) -> String {
        if !failure.is_out_of_space() {
            return with_causes(failure);
        }
        let pending = match failure {
            RecordingError::Video(relit_video::VideoError::DiskFull { missing, .. }) => *missing,
            _ => 0,
        };
        let left = self.left();
        let mean_bytes = self.writer.bytes / self.recorded().max(1);
        let missing = pending.saturating_add(left.saturating_mul(mean_bytes));
        format!(
            "{DISK_FULL}: in {} about {missing} bytes are missing for the rest of the turn ({}): {}",
            self.writer.session.folder().display(),
            count_of(left, "frame"),
            first_cause(failure)
        )
    }

    /// Frames before the turn, which are not a fault.
    fn lead_note(&self) -> Option<Fault> {
        let first = self.writer.session.index().entries().first()?;
        let lead = lead_of(&self.writer.delivered);
        let frames = count_of(lead, "frame");
        (lead > 0).then(|| Fault {
            t_us: first.t_us,
            what: format!(
                "{frames} before the turn are in the video, because later frames depend on them"
            ),
        })
    }

    /// The findings as the manifest lists them: only the first of a kind, if they are many.
    fn faults(&self, findings: &[Finding]) -> Vec<Fault> {
        let entries = self.writer.session.index().entries();
        let last_us = entries.last().map_or(0, |entry| entry.t_us);
        let fault = |finding: &Finding| {
            let (_, place) = finding.place();
            let mut delivered = self.writer.delivered.iter();
            let n = place.and_then(|_| delivered.position(|&at| at >= place));
            let n = n.unwrap_or(entries.len());
            Fault {
                t_us: entries.get(n).map_or(last_us, |entry| entry.t_us),
                what: finding.text(n),
            }
        };
        let mut faults = Vec::new();
        for kind in findings.chunk_by(|one, other| one.place().0 == other.place().0) {
            faults.extend(kind.iter().take(MAX_LISTED).map(fault));
            if kind.len() > MAX_LISTED {
                let what = format!("and {} more of this kind", kind.len() - MAX_LISTED);
                faults.push(Fault {
                    t_us: last_us,
                    what,
                });
            }
        }
        faults
    }
}

/// The error that caused all others: for one of the disk, the system's answer.
fn first_cause<'a>(error: &'a (dyn Error + 'static)) -> &'a (dyn Error + 'static) {
    let mut first = error;
    while let Some(cause) = first.source() {
        first = cause;
    }
    first
}

fn lost(findings: &[Finding]) -> u64 {
    findings.iter().map(Finding::lost).sum()
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
    FrameEntry {
        sequence,
        angle_deg: angle(entry.t_us).filter(is_possible_angle),
        ..*entry
    }
}

/// Frames of the video before the turn.
fn lead_of(delivered: &[Option<usize>]) -> u64 {
    delivered.iter().take_while(|at| at.is_none()).count() as u64
}
