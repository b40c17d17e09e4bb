//! A recording as a camera: a session folder or a video file, with the counter and the time stamps
//! that were recorded.
//!
//! Motion JPEG, raw video and H.264 are delivered as they are in the file (H.264 as a byte stream).
//! Other codecs, and H.264 with frames out of order, which no camera sends, are decoded and delivered
//! in the raw format with the same samples.
//!
//! Time stamps are those recorded, moved so that the first frame is due when the stream starts. A
//! frame comes when the clock shows its time stamp, so that a faster clock makes a faster replay. No
//! frame is lost if the reader is slow: a replay waits.

mod description;
mod faults;
mod source;
mod timeline;

use std::sync::Arc;
use std::time::Duration;

use self::description::{controls, describe, rate};
use self::faults::FaultInjector;
use self::source::{Delivery, Source};
use self::timeline::{FrameTime, Timeline};
use super::{
    Camera, CameraAddress, CameraError, CameraMode, Control, DeviceInfo, Fourcc, Frame, Mode,
    ReplayAddress,
};
use relit_data::clock::Clock;
use relit_data::session::{FrameClock, Recording};
use relit_video::{CodedFrame, Video};

/// A recording that behaves as the camera it was recorded with.
pub(super) struct ReplayCamera {
    info: DeviceInfo,
    address: ReplayAddress,
    video: Arc<Video>,
    delivery: Delivery,
    mode: CameraMode,
    timeline: Timeline,
    frame_clock: FrameClock,
    controls: Vec<Control>,
    clock: Clock,
    injector: FaultInjector,
    playing: Option<Playing>,
}

/// A running stream.
struct Playing {
    source: Source,
    /// What the clock showed at the start, microseconds.
    start_us: i64,
    /// How often the recording has ended.
    round: u64,
    /// Frames handed out.
    delivered: u64,
    /// The next frame, taken from the source and not yet due.
    next: Option<CodedFrame>,
}

impl ReplayCamera {
    pub(super) fn open(address: &ReplayAddress, clock: Clock) -> Result<Self, CameraError> {
        let recording = Recording::open(&address.path)?;
        let video = Arc::new(Video::open(&recording.video)?);
        let delivery = Delivery::from_video(&video)?;
        let timeline = Timeline::new(recording.frames.as_ref(), video.frames());
        let (width, height) = delivery.size(&video);
        let manifest = recording.manifest.as_ref();
        let mode = CameraMode {
            fourcc: Fourcc::from_pixel_format(delivery.format),
            width,
            height,
            rate: rate(manifest, &timeline).ok_or_else(|| CameraError::Replay {
                path: address.path.clone(),
                why: "it has no usable frame rate: replay another recording".to_owned(),
            })?,
        };
        let device = CameraAddress::Replay(address.clone());
        Ok(Self {
            info: describe(device, &recording, &video, &mode),
            address: address.clone(),
            injector: FaultInjector::new(address, &mode)?,
            video,
            delivery,
            mode,
            timeline,
            frame_clock: manifest.map_or(FrameClock::Driver, |manifest| manifest.camera.clock),
            controls: manifest.map(controls).unwrap_or_default(),
            clock,
            playing: None,
        })
    }
}

impl Camera for ReplayCamera {
    fn info(&self) -> &DeviceInfo {
        &self.info
    }

    fn modes(&mut self) -> Result<Vec<Mode>, CameraError> {
        Ok(self.info.modes.clone())
    }

    fn controls(&mut self) -> Result<Vec<Control>, CameraError> {
        Ok(self.controls.clone())
    }

    fn set_control(&mut self, _: u32, _: i64) -> Result<i64, CameraError> {
        Err(CameraError::Unsupported {
            device: self.info.address.to_string(),
            what: "a recording's controls cannot be changed".to_owned(),
        })
    }

    fn start(&mut self, _: &CameraMode) -> Result<CameraMode, CameraError> {
        self.playing = None;
        self.playing = Some(Playing {
            source: self.delivery.open(&self.video)?,
            start_us: self.clock.now_us(),
            round: 0,
            delivered: 0,
            next: None,
        });
        Ok(self.mode)
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError> {
        let Some(mut playing) = self.playing.take() else {
            return Err(CameraError::NotStarted {
                device: self.info.address.to_string(),
            });
        };
        let frame = self.advance(&mut playing, timeout);
        self.playing = Some(playing);
        frame
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.playing = None;
        Ok(())
    }
}

impl ReplayCamera {
    fn advance(&self, playing: &mut Playing, timeout: Duration) -> Result<Frame, CameraError> {
        let deadline_us = self.clock.after(timeout);
        let device = || self.info.address.to_string();
        loop {
            let taken = match playing.next.take() {
                Some(taken) => taken,
                None => self.take(playing)?,
            };
            let earlier = playing.round.saturating_mul(self.timeline.len() as u64);
            let position = earlier.saturating_add(taken.number);
            let reached = |at: Option<u64>| at.is_some_and(|at| at <= position);
            let moment = self.timeline.moment(taken.number, playing.round);
            let due_us = if reached(self.address.faults.stall) {
                i64::MAX
            } else {
                playing.start_us.saturating_add(moment.since_first_us)
            };
            self.clock.sleep_until(due_us.min(deadline_us));
            if due_us > deadline_us {
                playing.next = Some(taken);
                return Err(CameraError::Timeout {
                    device: device(),
                    waited: timeout,
                });
            }
            if reached(self.address.faults.unplug) {
                playing.next = Some(taken);
                return Err(CameraError::Unplugged {
                    device: device(),
                    source: None,
                });
            }
            if self.address.faults.drop.contains(&position) {
                continue;
            }
            playing.delivered += 1;
            let frame = self.frame(taken, moment, due_us);
            return Ok(self.injector.inject(frame, position));
        }
    }

    /// The next frame of the source; the first again after the last, where that is requested.
    fn take(&self, playing: &mut Playing) -> Result<CodedFrame, CameraError> {
        let mut taken = playing.source.next();
        if taken.is_none() && self.address.repeat {
            playing.source = self.delivery.open(&self.video)?;
            playing.round += 1;
            taken = playing.source.next();
        }
        taken.ok_or_else(|| CameraError::EndOfRecording {
            path: self.address.path.clone(),
            frames: playing.delivered,
        })
    }

    fn frame(&self, taken: CodedFrame, moment: FrameTime, t_us: i64) -> Frame {
        Frame {
            fourcc: self.mode.fourcc,
            width: self.mode.width,
            height: self.mode.height,
            data: taken.data,
            sequence: Some(moment.sequence),
            t_us,
            clock: self.frame_clock,
            flagged: taken.damaged,
        }
    }
}

#[cfg(test)]
mod tests;
