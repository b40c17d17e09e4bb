//! The thread that writes: frames from the queue to the video and the index, and both to the disk
//! twice a second.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError};

use super::environment_light::EnvironmentLight;
use super::error::RecordingError;
use super::finding::Finding;
use super::outcome::WriterOutcome;
use super::progress::Shared;
use super::trimmer::TurnFrame;
use relit_data::session::{FrameEntry, SessionWriter};
use relit_data::turn_motion::{JournaledReport, JournaledTurn};
use relit_video::{Muxer, StreamFormat, WriteOutcome};

/// How often everything is synced to the disk: with the time that the disk needs for it, nothing
/// there is older than a second.
const SYNC_EVERY: Duration = Duration::from_millis(400);

/// A line of the session's journal.
pub(super) enum JournalLine {
    Turn(JournaledTurn),
    Report(JournaledReport),
}

/// Video and session being written.
pub(super) struct WriterThread {
    pub(super) stream: StreamFormat,
    pub(super) muxer: Muxer,
    pub(super) session: SessionWriter,
    pub(super) delivered: Vec<Option<usize>>,
    pub(super) findings: Vec<Finding>,
    pub(super) queue: Receiver<TurnFrame>,
    pub(super) journal: Receiver<JournalLine>,
    pub(super) light: EnvironmentLight,
    pub(super) shared: Arc<Shared>,
}

impl WriterThread {
    /// Writes what is queued until no more comes, or the disk refuses.
    pub(super) fn run(mut self) -> WriterOutcome {
        let written = self.write_all();
        let bytes = self.muxer.bytes();
        let finished = self.muxer.finish();
        WriterOutcome {
            session: self.session,
            delivered: self.delivered,
            findings: self.findings,
            light: self.light,
            bytes,
            failure: written.and(finished.map_err(RecordingError::from)).err(),
        }
    }

    fn write_all(&mut self) -> Result<(), RecordingError> {
        let mut due = Instant::now() + SYNC_EVERY;
        loop {
            match self.queue.recv_deadline(due) {
                Ok(frame) => self.add(&frame)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    self.keep_journal();
                    return Ok(());
                }
            }
            self.keep_journal();
            self.shared.lock().progress.frames = self.muxer.frames();
            if Instant::now() >= due {
                self.muxer.sync()?;
                self.session.sync()?;
                due = Instant::now() + SYNC_EVERY;
            }
        }
    }

    /// Writes what the table reported.
    fn keep_journal(&mut self) {
        for line in self.journal.try_iter() {
            match line {
                JournalLine::Turn(turn) => self.session.begin_journal(turn),
                JournalLine::Report(report) => self.session.add_report(report),
            }
        }
    }

    fn add(&mut self, turn_frame: &TurnFrame) -> Result<(), RecordingError> {
        let frame = &turn_frame.frame;
        let written = match self.padded(&frame.data) {
            Some(padded) => self.muxer.write(&padded, frame.t_us)?,
            None => self.muxer.write(&frame.data, frame.t_us)?,
        };
        if written == WriteOutcome::BeforeKeyFrame {
            let left_out = turn_frame.delivered.map(Finding::Unusable);
            self.findings.extend(left_out);
            return Ok(());
        }
        // The index has to grow, whatever the driver's counter and time stamps do.
        let last = self.session.index().entries().last();
        let sequence = frame.sequence.unwrap_or(0);
        let entry = FrameEntry {
            n: self.delivered.len() as u64,
            sequence: sequence.max(last.map_or(0, |last| last.sequence.saturating_add(1))),
            t_us: frame
                .t_us
                .max(last.map_or(i64::MIN, |last| last.t_us.saturating_add(1))),
            angle_deg: None,
        };
        self.session.push(entry)?;
        self.delivered.push(turn_frame.delivered);
        if let Some(at) = turn_frame.delivered {
            self.light.add(at, &frame.data);
        }
        Ok(())
    }

    /// Part of a raw picture, filled up with zeros, so that what arrived is kept.
    fn padded(&self, data: &[u8]) -> Option<Vec<u8>> {
        let stream = &self.stream;
        let whole = stream.format.frame_bytes(stream.width, stream.height)?;
        (data.len() < whole).then(|| {
            let mut padded = data.to_vec();
            padded.resize(whole, 0);
            padded
        })
    }
}
