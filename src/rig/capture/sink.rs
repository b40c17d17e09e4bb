//! The thread that writes: frames from the queue to the video and the index, and both to the disk
//! twice a second.

use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::{Duration, Instant};

use super::Error;
use super::recorder::Shared;
use super::window::Chosen;
use relit_data::session::{FrameEntry, SessionWriter};
use relit_video::{Muxer, StreamFormat, Written};

/// How often all that was taken is brought to the disk: with the time that the disk needs for it,
/// nothing there is older than a second.
const SYNC_EVERY: Duration = Duration::from_millis(400);

/// Writes what it is given until no more comes, or the disk refuses.
pub(super) struct Sink {
    stream: StreamFormat,
    muxer: Muxer,
    session: SessionWriter,
    places: Vec<Option<usize>>,
    left_out: Vec<usize>,
}

/// What is on the disk when no more comes.
pub(super) struct Sunk {
    pub(super) session: SessionWriter,
    /// For each frame of the video its place among the delivered frames of the turn.
    pub(super) places: Vec<Option<usize>>,
    /// Delivered frames of the turn that were left out, as no key frame came before them.
    pub(super) left_out: Vec<usize>,
    /// Bytes of video.
    pub(super) bytes: u64,
    /// What the disk refused.
    pub(super) failure: Option<Error>,
}

impl Sink {
    pub(super) fn new(stream: StreamFormat, session: SessionWriter) -> Result<Self, Error> {
        let muxer = Muxer::create(&session.video_path(), stream)?;
        Ok(Self {
            stream,
            muxer,
            session,
            places: Vec::new(),
            left_out: Vec::new(),
        })
    }

    pub(super) fn run(mut self, queue: &Receiver<Chosen>, shared: &Shared) -> Sunk {
        let failure = self.write_all(queue, shared).err();
        let bytes = self.muxer.bytes();
        let finished = self.muxer.finish().map_err(Error::from);
        Sunk {
            session: self.session,
            places: self.places,
            left_out: self.left_out,
            bytes,
            failure: failure.or(finished.err()),
        }
    }

    fn write_all(&mut self, queue: &Receiver<Chosen>, shared: &Shared) -> Result<(), Error> {
        let mut due = Instant::now() + SYNC_EVERY;
        loop {
            match queue.recv_timeout(due.saturating_duration_since(Instant::now())) {
                Ok(chosen) => self.add(&chosen)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return Ok(()),
            }
            shared.wrote(self.muxer.frames(), self.muxer.bytes());
            if Instant::now() >= due {
                self.muxer.sync()?;
                self.session.sync()?;
                due = Instant::now() + SYNC_EVERY;
            }
        }
    }

    fn add(&mut self, chosen: &Chosen) -> Result<(), Error> {
        let frame = &chosen.frame;
        let written = match self.whole_picture(&frame.data) {
            Some(padded) => self.muxer.write(&padded, frame.t_us)?,
            None => self.muxer.write(&frame.data, frame.t_us)?,
        };
        if written == Written::BeforeKeyFrame {
            self.left_out.extend(chosen.delivered);
            return Ok(());
        }
        let last = self.session.index().entries().last();
        // An index grows, whatever the driver says; the trace tells what it said.
        let after = |least: Option<u64>| least.map_or(0, |least| least.saturating_add(1));
        let counted = frame.sequence.map_or(0, |sequence| sequence.unwrapped);
        let entry = FrameEntry {
            n: self.places.len() as u64,
            sequence: counted.max(after(last.map(|last| last.sequence))),
            t_us: last.map_or(frame.t_us, |last| {
                frame.t_us.max(last.t_us.saturating_add(1))
            }),
            angle_deg: None,
        };
        self.session.push(entry)?;
        self.places.push(chosen.delivered);
        Ok(())
    }

    /// Half a raw picture, filled up with zeros: what came of it is kept.
    fn whole_picture(&self, data: &[u8]) -> Option<Vec<u8>> {
        let stream = &self.stream;
        let wanted = stream.format.frame_bytes(stream.width, stream.height)?;
        (data.len() < wanted).then(|| {
            let mut padded = data.to_vec();
            padded.resize(wanted, 0);
            padded
        })
    }
}
