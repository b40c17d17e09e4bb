//! The thread that has the camera: takes every frame, shows it, and queues those of the turn.

use std::sync::Arc;
use std::sync::mpsc::{SyncSender, TrySendError};
use std::thread;
use std::time::{Duration, Instant};

use super::recorder::{Shared, Stage, WhenFull};
use super::take::{Damaged, End};
use super::window::{Chosen, Count, Cutter};
use crate::camera::{Camera, CameraError, Frame, FrameFault};
use relit_video::{PixelFormat, StreamFormat, is_key};

/// Longest wait for a frame in one go: how late a stop is seen.
const GLANCE: Duration = Duration::from_millis(100);
/// How long the last frames of a turn may wait for a place in the queue.
const LAST_WAIT: Duration = Duration::from_secs(4);
/// How long a camera that can wait does so.
const PATIENCE: Duration = Duration::from_secs(60);

/// A camera being filmed with.
pub(super) struct Film {
    camera: Box<dyn Camera>,
    stall: Duration,
    when_full: WhenFull,
    cutter: Cutter,
    damaged: Vec<Damaged>,
    overrun: Vec<usize>,
    empty: Vec<usize>,
}

/// What comes of it.
pub(super) struct Filmed {
    pub(super) camera: Box<dyn Camera>,
    pub(super) end: End,
    pub(super) count: Count,
    /// Frames of the turn that are damaged.
    pub(super) damaged: Vec<Damaged>,
    /// Delivered frames of the turn for which there was no place in the queue.
    pub(super) overrun: Vec<usize>,
    /// Delivered frames of the turn without a single byte.
    pub(super) empty: Vec<usize>,
}

impl Film {
    pub(super) fn new(
        camera: Box<dyn Camera>,
        stream: &StreamFormat,
        stall: Duration,
        when_full: WhenFull,
    ) -> Self {
        let chain = (stream.format == PixelFormat::H264).then_some(is_key as fn(&[u8]) -> bool);
        Self {
            camera,
            stall,
            when_full,
            cutter: Cutter::new(stream.fps, chain),
            damaged: Vec::new(),
            overrun: Vec::new(),
            empty: Vec::new(),
        }
    }

    pub(super) fn run(mut self, queue: &SyncSender<Chosen>, shared: &Shared) -> Filmed {
        let end = self.film(queue, shared);
        shared.enter(Stage::Ended);
        shared.preview.end();
        let (rest, count) = self.cutter.end();
        let until = Instant::now() + LAST_WAIT;
        for chosen in rest {
            let place = chosen.delivered;
            if self.judge(&chosen) && offer(queue, chosen, until) != Offered::Taken {
                self.overrun.extend(place);
            }
        }
        Filmed {
            camera: self.camera,
            end,
            count,
            damaged: self.damaged,
            overrun: self.overrun,
            empty: self.empty,
        }
    }

    /// Films until something ends it.
    fn film(&mut self, queue: &SyncSender<Chosen>, shared: &Shared) -> End {
        let mut last = Instant::now();
        loop {
            if shared.stop_asked() {
                return End::Stopped;
            }
            if !self.cutter.knows_window()
                && let Some(window) = shared.window()
            {
                let chosen = self.cutter.announce(window);
                if let Some(end) = self.queue_all(chosen, queue, shared) {
                    return end;
                }
            }
            match self.camera.next_frame(GLANCE.min(self.stall)) {
                Ok(frame) => {
                    last = Instant::now();
                    if let Some(end) = self.take(frame, queue, shared) {
                        return end;
                    }
                }
                Err(CameraError::Timeout { .. }) => {
                    let waited = last.elapsed();
                    if waited >= self.stall {
                        return End::Stalled { waited };
                    }
                }
                Err(CameraError::EndOfRecording { .. }) => return End::SourceOver,
                Err(error) => return End::Camera(error),
            }
        }
    }

    fn take(&mut self, frame: Frame, queue: &SyncSender<Chosen>, shared: &Shared) -> Option<End> {
        if let Some(fault) = frame.fault().filter(is_other_size) {
            return Some(End::OtherSize(fault));
        }
        let frame = Arc::new(frame);
        shared.preview.publish(&frame);
        let chosen = self.cutter.push(frame);
        self.queue_all(chosen, queue, shared)
    }

    /// Notes what is wrong with a frame of the turn; false where it has nothing to record.
    fn judge(&mut self, chosen: &Chosen) -> bool {
        let fault = chosen.frame.fault();
        match (chosen.delivered, fault) {
            (Some(place), Some(FrameFault::Empty)) => self.empty.push(place),
            (Some(delivered), Some(fault)) => self.damaged.push(Damaged { delivered, fault }),
            _ => {}
        }
        fault != Some(FrameFault::Empty) && !chosen.frame.data.is_empty()
    }

    fn queue_all(
        &mut self,
        chosen: Vec<Chosen>,
        queue: &SyncSender<Chosen>,
        shared: &Shared,
    ) -> Option<End> {
        if self.cutter.has_begun() {
            shared.enter(Stage::Recording);
        }
        for chosen in chosen {
            let place = chosen.delivered;
            if !self.judge(&chosen) {
                continue;
            }
            let until = match self.when_full {
                WhenFull::Drop => Instant::now(),
                WhenFull::Wait => Instant::now() + PATIENCE,
            };
            match offer(queue, chosen, until) {
                Offered::Taken => {}
                Offered::NoPlace => {
                    self.overrun.extend(place);
                    shared.overran();
                }
                Offered::Closed => return Some(End::Disk),
            }
        }
        self.cutter.is_done().then_some(End::Over)
    }
}

/// What became of a frame for the queue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Offered {
    Taken,
    NoPlace,
    /// The disk refused, and nothing is taken any more.
    Closed,
}

/// Puts a frame into the queue, as soon as there is a place before `until`.
fn offer(queue: &SyncSender<Chosen>, mut chosen: Chosen, until: Instant) -> Offered {
    loop {
        chosen = match queue.try_send(chosen) {
            Ok(()) => return Offered::Taken,
            Err(TrySendError::Full(chosen)) if Instant::now() < until => chosen,
            Err(TrySendError::Full(_)) => return Offered::NoPlace,
            Err(TrySendError::Disconnected(_)) => return Offered::Closed,
        };
        thread::sleep(Duration::from_millis(2));
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
