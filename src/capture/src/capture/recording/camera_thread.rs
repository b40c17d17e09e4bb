//! The thread that reads the camera: takes every frame, shows it, and queues those of the turn.

use std::sync::Arc;
use std::time::{Duration, Instant};

use crossbeam_channel::{SendTimeoutError, Sender};

use relit_data::causes::with_causes;

use super::finding::Finding;
use super::outcome::{CameraOutcome, EndReason};
use super::progress::Shared;
use super::trimmer::{Trimmer, TurnFrame};
use crate::preview::Preview;
use relit_camera::{Camera, CameraError, Frame, FrameFault};

/// Longest wait for a frame in one go: how late a stop is noticed.
const FRAME_WAIT: Duration = Duration::from_millis(100);
/// How long all frames that are queued at once may wait for places, such as those that a decoder needs before the turn.
const BURST_WAIT: Duration = Duration::from_millis(200);
/// How long the last frames of a turn may wait for a place in the queue.
const LAST_WAIT: Duration = Duration::from_secs(4);

/// A camera, and what has come of it so far.
pub(super) struct CameraThread {
    pub(super) camera: Box<dyn Camera>,
    /// Where every frame is shown.
    pub(super) preview: Option<Preview>,
    /// Without a frame for so long the camera counts as failed.
    pub(super) stall: Duration,
    /// How long a frame may wait for a place in the queue.
    pub(super) queue_wait: Duration,
    pub(super) queue: Sender<TurnFrame>,
    pub(super) shared: Arc<Shared>,
    pub(super) trimmer: Trimmer,
    pub(super) findings: Vec<Finding>,
}

impl CameraThread {
    /// Records until something ends it; gives the camera back, still started.
    pub(super) fn run(mut self) -> (Box<dyn Camera>, CameraOutcome) {
        let mut last_us = self.shared.clock().now_us();
        let end = loop {
            if let Err(end) = self.step(&mut last_us) {
                break end;
            }
        };
        let (rest, count) = self.trimmer.end();
        let until = Instant::now() + LAST_WAIT;
        for frame in rest {
            // A disk that refuses is the writer's to report.
            let _ = self.enqueue(frame, until);
        }
        self.shared.update(|state| state.progress.ended = true);
        let outcome = CameraOutcome {
            end,
            count,
            findings: self.findings,
        };
        (self.camera, outcome)
    }

    /// Takes the next frame; `last_us`: when the one before came.
    fn step(&mut self, last_us: &mut i64) -> Result<(), EndReason> {
        self.obey()?;
        let frame = self.camera.next_frame(FRAME_WAIT.min(self.stall));
        let now_us = self.shared.clock().now_us();
        match frame {
            Ok(frame) => {
                *last_us = now_us;
                self.take(frame)
            }
            Err(CameraError::Timeout { .. }) => {
                let waited = Duration::from_micros(now_us.abs_diff(*last_us));
                if waited >= self.stall {
                    Err(EndReason::Failed(format!(
                        "the camera gave no frame for {:.1} s: check its cable",
                        waited.as_secs_f64()
                    )))
                } else {
                    Ok(())
                }
            }
            Err(CameraError::EndOfRecording { .. }) => Err(EndReason::Failed(
                "the replayed recording has ended".to_owned(),
            )),
            Err(error) => Err(EndReason::Failed(with_causes(&error))),
        }
    }

    /// Does what the owner wants.
    fn obey(&mut self) -> Result<(), EndReason> {
        let (stop, window) = {
            let state = self.shared.lock();
            (state.stop, state.window)
        };
        match window {
            _ if stop => Err(EndReason::Stopped),
            Some(window) if !self.trimmer.knows_window() => {
                let frames = self.trimmer.announce(window);
                self.enqueue_all(frames)
            }
            _ => Ok(()),
        }
    }

    fn take(&mut self, frame: Frame) -> Result<(), EndReason> {
        if let Some(fault) = frame.fault().filter(is_other_size) {
            let what = format!("the camera changed what it delivers: {fault}");
            return Err(EndReason::Failed(what));
        }
        let frame = Arc::new(frame);
        if let Some(preview) = &self.preview {
            preview.publish(&frame);
        }
        let frames = self.trimmer.push(frame);
        self.enqueue_all(frames)
    }

    fn enqueue_all(&mut self, frames: Vec<TurnFrame>) -> Result<(), EndReason> {
        let wait = if frames.len() > 1 {
            self.queue_wait.max(BURST_WAIT)
        } else {
            self.queue_wait
        };
        let until = Instant::now() + wait;
        for frame in frames {
            self.enqueue(frame, until)?;
        }
        if self.trimmer.is_done() {
            Err(EndReason::Over)
        } else {
            Ok(())
        }
    }

    /// Queues a frame as soon as there is a place before `until`, and notes what is wrong with it.
    fn enqueue(&mut self, frame: TurnFrame, until: Instant) -> Result<(), EndReason> {
        let (delivered, fault) = (frame.delivered, frame.frame.fault());
        let finding = if frame.frame.data.is_empty() {
            delivered.map(Finding::Unusable)
        } else {
            match self.queue.send_deadline(frame, until) {
                Ok(()) => delivered
                    .zip(fault)
                    .map(|(at, fault)| Finding::Damaged(at, fault)),
                Err(SendTimeoutError::Timeout(_)) => {
                    self.shared.lock().progress.overrun += 1;
                    // Without those before it, the first cannot be decoded.
                    Some(Finding::QueueFull(delivered.unwrap_or(0)))
                }
                Err(SendTimeoutError::Disconnected(_)) => {
                    return Err(EndReason::Failed(
                        "the disk accepted no more data".to_owned(),
                    ));
                }
            }
        };
        self.findings.extend(finding);
        Ok(())
    }
}

/// More than a damaged frame: the camera delivers something else than was agreed.
fn is_other_size(fault: &FrameFault) -> bool {
    match fault {
        FrameFault::OtherSize { .. } => true,
        FrameFault::Bytes { expected, found } => found > expected,
        FrameFault::Flagged | FrameFault::Empty | FrameFault::NoStart | FrameFault::NoEnd => false,
    }
}
