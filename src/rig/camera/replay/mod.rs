//! A recording as a camera: a session folder or a video file, with the counter and the time stamps
//! that were recorded.
//!
//! Motion JPEG, raw video and H.264 come as they are in the file (H.264 as a byte stream). Other
//! codecs, and H.264 whose frames stand out of order, as no camera sends them, are decoded and come
//! in the raw format that holds the same samples.
//!
//! Time stamps are those recorded, moved so that the first frame is due when the stream starts. A
//! frame comes when the clock shows its time stamp. At a speed other than 1, time stamps are as much
//! closer together on the clock; as fast as it is read, they run ahead of it. No frame is lost if the
//! reader is slow: a replay waits.

mod description;
mod faults;
mod source;
mod timeline;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use self::description::{controls, describe, rate, stamp};
use self::faults::FaultInjector;
use self::source::{Delivery, Source, Taken};
use self::timeline::{Moment, Timeline};
use super::{
    Camera, CameraAddress, CameraError, Control, ControlId, DeviceInfo, Fourcc, Frame, GrantedMode,
    Mode, ModeRequest, ReplayFaults, ReplaySpeed, Sequence, StampSource,
};
use crate::clock::Clock;
use relit_data::session::Recording;
use relit_video::Video;

/// A recording that behaves as the camera it was recorded with.
pub(super) struct ReplayCamera {
    info: DeviceInfo,
    path: PathBuf,
    video: Arc<Video>,
    delivery: Delivery,
    mode: GrantedMode,
    timeline: Timeline,
    stamp: StampSource,
    controls: Vec<Control>,
    pace: Pace,
    repeat: bool,
    faults: ReplayFaults,
    injector: FaultInjector,
    playing: Option<Playing>,
}

/// How time stamps of the recording become those of the clock, and whether they are waited for.
#[derive(Debug)]
struct Pace {
    clock: Clock,
    /// Time on the clock for one of the recording.
    stretch: f64,
    wait: bool,
}

/// A running stream.
struct Playing {
    source: Source,
    /// What the clock showed at the start, microseconds.
    start_us: i64,
    /// How often the recording has come to its end.
    round: u64,
    /// Frames handed out.
    delivered: u64,
    /// The next frame, taken from the source and not yet due.
    next: Option<Taken>,
    ended: Option<End>,
}

/// Why no more frames come.
#[derive(Debug, Clone, Copy)]
enum End {
    Recording,
    Unplugged,
    Stalled,
}

impl ReplayCamera {
    pub(super) fn open(
        path: &Path,
        speed: ReplaySpeed,
        repeat: bool,
        faults: &ReplayFaults,
        clock: Clock,
    ) -> Result<Self, CameraError> {
        let recording = Recording::open(path)?;
        let video = Arc::new(Video::open(&recording.video)?);
        let delivery = Delivery::of(&video)?;
        let timeline = Timeline::new(recording.frames.as_ref(), video.frames());
        let (width, height) = delivery.size(&video);
        let manifest = recording.manifest.as_ref();
        let mode = GrantedMode {
            fourcc: Fourcc::of(delivery.format),
            width,
            height,
            rate: rate(manifest, &timeline),
        };
        let injector = FaultInjector::new(path, faults, &mode)?;
        let address = CameraAddress::Replay {
            path: path.to_owned(),
            speed,
            repeat,
            faults: faults.clone(),
        };
        Ok(Self {
            info: describe(address, &recording, &video, &mode),
            path: path.to_owned(),
            video,
            delivery,
            mode,
            timeline,
            stamp: manifest.map_or(StampSource::EndOfFrame, stamp),
            controls: manifest.map(controls).unwrap_or_default(),
            pace: Pace::new(speed, clock),
            repeat,
            faults: faults.clone(),
            injector,
            playing: None,
        })
    }

    fn end_error(&self, end: End, delivered: u64, waited: Duration) -> CameraError {
        let device = self.info.address.to_string();
        match end {
            End::Recording => CameraError::EndOfRecording {
                path: self.path.clone(),
                frames: delivered,
            },
            End::Unplugged => CameraError::Unplugged {
                device,
                source: None,
            },
            End::Stalled => CameraError::Timeout { device, waited },
        }
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

    fn set_control(&mut self, _: ControlId, _: i64) -> Result<i64, CameraError> {
        Err(CameraError::Unsupported {
            device: self.info.address.to_string(),
            what: "a recording's controls stand as they were recorded",
        })
    }

    fn start(&mut self, _: &ModeRequest) -> Result<GrantedMode, CameraError> {
        self.playing = None;
        self.playing = Some(Playing {
            source: self.delivery.open(&self.video)?,
            start_us: self.pace.clock.now_us(),
            round: 0,
            delivered: 0,
            next: None,
            ended: None,
        });
        Ok(self.mode)
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CameraError> {
        let deadline_us = self.pace.clock.after(timeout);
        let Some(mut playing) = self.playing.take() else {
            return Err(CameraError::NotStarted {
                device: self.info.address.to_string(),
            });
        };
        let found = self.advance(&mut playing, deadline_us);
        let delivered = playing.delivered;
        self.playing = Some(playing);
        match found? {
            Step::Frame(frame) => Ok(frame),
            Step::TooEarly => Err(self.end_error(End::Stalled, delivered, timeout)),
            Step::End(End::Stalled) => {
                self.pace.clock.sleep_until(deadline_us);
                Err(self.end_error(End::Stalled, delivered, timeout))
            }
            Step::End(end) => Err(self.end_error(end, delivered, timeout)),
        }
    }

    fn stop(&mut self) -> Result<(), CameraError> {
        self.playing = None;
        Ok(())
    }
}

/// What one look for a frame found.
enum Step {
    Frame(Frame),
    /// The next frame is due after the deadline.
    TooEarly,
    End(End),
}

impl ReplayCamera {
    fn advance(&mut self, playing: &mut Playing, deadline_us: i64) -> Result<Step, CameraError> {
        loop {
            if let Some(end) = playing.ended {
                return Ok(Step::End(end));
            }
            let taken = match playing.next.take() {
                Some(taken) => taken,
                None => match self.take(playing)? {
                    Some(taken) => taken,
                    None => {
                        playing.ended = Some(End::Recording);
                        continue;
                    }
                },
            };
            let length = self.timeline.len() as u64;
            let position = playing
                .round
                .saturating_mul(length)
                .saturating_add(taken.number);
            let reached = |at: Option<u64>| at.is_some_and(|at| at <= position);
            if reached(self.faults.stall) {
                playing.ended = Some(End::Stalled);
                continue;
            }
            let moment = self.timeline.moment(taken.number, playing.round);
            let due_us = self.pace.due_us(playing.start_us, moment.since_first_us);
            if !self.pace.wait_until(due_us, deadline_us) {
                playing.next = Some(taken);
                return Ok(Step::TooEarly);
            }
            if reached(self.faults.unplug) {
                playing.ended = Some(End::Unplugged);
                continue;
            }
            if self.faults.drop.contains(&position) {
                continue;
            }
            playing.delivered += 1;
            let frame = self.frame(taken, moment, due_us);
            return Ok(Step::Frame(self.injector.inject(
                frame,
                position,
                &self.faults,
            )));
        }
    }

    /// The next frame of the source; the first again after the last, where that is asked for.
    fn take(&self, playing: &mut Playing) -> Result<Option<Taken>, CameraError> {
        if let Some(taken) = playing.source.next() {
            return Ok(Some(taken));
        }
        if !self.repeat {
            return Ok(None);
        }
        playing.source = self.delivery.open(&self.video)?;
        playing.round += 1;
        Ok(playing.source.next())
    }

    fn frame(&self, taken: Taken, moment: Moment, t_us: i64) -> Frame {
        Frame {
            fourcc: self.mode.fourcc,
            width: self.mode.width,
            height: self.mode.height,
            data: taken.data,
            sequence: Some(Sequence {
                raw: moment.sequence as u32,
                unwrapped: moment.sequence,
            }),
            t_us,
            stamp: self.stamp,
            flagged: taken.damaged,
        }
    }
}

impl Pace {
    fn new(speed: ReplaySpeed, clock: Clock) -> Self {
        match speed {
            ReplaySpeed::AsRead => Self {
                clock,
                stretch: 1.0,
                wait: false,
            },
            ReplaySpeed::Times(times) => Self {
                clock,
                stretch: times.recip(),
                wait: true,
            },
        }
    }

    fn due_us(&self, start_us: i64, since_first_us: i64) -> i64 {
        // Not through floating point where nothing is stretched: every microsecond counts.
        let since_start = if self.stretch == 1.0 {
            since_first_us
        } else {
            (since_first_us as f64 * self.stretch) as i64
        };
        start_us.saturating_add(since_start)
    }

    /// Waits until the clock shows this, or until the deadline; true where the clock shows it.
    fn wait_until(&self, due_us: i64, deadline_us: i64) -> bool {
        if self.wait {
            self.clock.sleep_until(due_us.min(deadline_us));
        }
        !self.wait || due_us <= deadline_us
    }
}

#[cfg(test)]
mod tests;
