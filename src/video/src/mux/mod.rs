//! Writing a camera's stream to a Matroska file that can be read at any moment: clusters are short,
//! [`Muxer::sync`] writes everything to the disk, and no reader needs the index that
//! [`Muxer::finish`] adds.
//!
//! Motion JPEG and H.264 are stored as the camera delivers them, uncompressed pictures as FFV1,
//! without loss. FFmpeg writes Matroska's time stamps in milliseconds: each frame's time is rounded
//! to the nearest one, relative to the first frame. The caller keeps the exact time stamps.

mod container;
mod file;

use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

use ffmpeg_next::codec::encoder;
use ffmpeg_next::format::context::{Output, StreamIo};
use ffmpeg_next::{Packet, packet};

use self::container::{end_cluster, open};
use self::file::{FirstError, Sink};

use relit_data::disk::is_full;

use super::nal::{self, ParameterSets};
use super::{PixelFormat, StreamFormat, VideoError, initialise, lossless};

/// Bytes that are buffered before they are written.
const BUFFER: usize = 1 << 15;

/// What became of a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WriteOutcome {
    /// It is in the file, or on its way there.
    Kept,
    /// It was left out: it depends on frames before the recording's first key frame.
    BeforeKeyFrame,
}

/// A video file that is being written.
pub struct Muxer {
    path: PathBuf,
    stream: StreamFormat,
    file: File,
    refusal: FirstError,
    state: State,
    encoder: Option<encoder::video::Encoder>,
    sets: ParameterSets,
    first_us: Option<i64>,
    last_ms: i64,
    frames: u64,
    /// Bytes of the packets that were handed to FFmpeg.
    taken: u64,
}

/// The state of the file.
enum State {
    /// The header is not written: the parameters of H.264 are in the stream.
    Waiting(StreamIo),
    Running(Output),
    /// Something failed, and nothing more can be written.
    Broken,
}

impl std::fmt::Debug for Muxer {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Muxer({}, {} frames)", self.path.display(), self.frames)
    }
}

impl Muxer {
    /// Creates a new file at `path`.
    ///
    /// # Errors
    /// [`VideoError::Refused`] if the format cannot have this size or this FFmpeg lacks the codec,
    /// [`VideoError::Write`] if the file cannot be created or exists.
    pub fn create(path: &Path, stream: StreamFormat) -> Result<Self, VideoError> {
        initialise();
        let refused = |source| VideoError::Write {
            path: path.to_owned(),
            source,
        };
        let failed = |why| not_created(path, why);
        let (format, width, height) = (stream.format, stream.width, stream.height);
        let encoder = match format {
            PixelFormat::Mjpeg | PixelFormat::H264 => None,
            _ => {
                lossless::picture_bytes(format, width, height).ok_or_else(|| {
                    VideoError::Refused(format!(
                        "{width} x {height} pixels are not possible in this pixel format: choose another mode"
                    ))
                })?;
                Some(lossless::encoder(format, width, height).map_err(failed)?)
            }
        };
        let mut options = OpenOptions::new();
        let file = options.write(true).create_new(true).open(path);
        let file = file.map_err(refused)?;
        let refusal = FirstError::default();
        let sink = Sink {
            file: file.try_clone().map_err(refused)?,
            refusal: refusal.clone(),
        };
        let io = StreamIo::from_write_seek_with_capacity(sink, BUFFER).map_err(failed)?;
        Ok(Self {
            path: path.to_owned(),
            stream,
            file,
            refusal,
            state: State::Waiting(io),
            encoder,
            sets: ParameterSets::default(),
            first_us: None,
            last_ms: 0,
            frames: 0,
            taken: 0,
        })
    }

    /// Frames in the file.
    pub fn frames(&self) -> u64 {
        self.frames
    }

    /// Bytes taken so far, after coding.
    pub fn bytes(&self) -> u64 {
        self.taken
    }

    /// Adds a frame that was taken at `t_us` microseconds of the camera's clock.
    ///
    /// # Errors
    /// [`VideoError::DiskFull`] if the disk is full, [`VideoError::Write`] if it fails otherwise,
    /// [`VideoError::Refused`] if an uncompressed picture has not the bytes of one (nothing was
    /// written then, and the next may follow), H.264 has no start codes, or FFmpeg cannot code it.
    pub fn write(&mut self, data: &[u8], t_us: i64) -> Result<WriteOutcome, VideoError> {
        let chained = self.stream.format == PixelFormat::H264;
        if chained {
            if !nal::is_annex_b(data) {
                return Err(VideoError::Refused(format!(
                    "the stream for {} is not H.264 with start codes: choose another mode of the camera",
                    self.path.display()
                )));
            }
            self.sets.gather(data);
        }
        let key = !chained || nal::is_key(data);
        if matches!(self.state, State::Waiting(_)) {
            if !key || (chained && self.sets.extradata().is_none()) {
                return Ok(WriteOutcome::BeforeKeyFrame);
            }
            self.begin()?;
        }
        let first = *self.first_us.get_or_insert(t_us);
        // Readers sort Matroska's frames by time: without growing times they would be swapped.
        let ms = (t_us.saturating_sub(first).saturating_add(500)) / 1000;
        let ms = if self.frames == 0 {
            0
        } else {
            ms.max(self.last_ms)
        };
        let mut packet = match self.stream.format {
            PixelFormat::Mjpeg | PixelFormat::H264 => Packet::copy(data),
            _ => self.encode(data, ms)?,
        };
        packet.set_stream(0);
        packet.set_pts(Some(ms));
        packet.set_dts(Some(ms));
        if key {
            packet.set_flags(packet::Flags::KEY);
        }
        self.taken += packet.size() as u64;
        self.run(|output| packet.write(output).map(|_| ()))?;
        self.last_ms = ms;
        self.frames += 1;
        Ok(WriteOutcome::Kept)
    }

    /// Writes all frames to the system: a process that is killed after this loses none of them.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn flush(&mut self) -> Result<(), VideoError> {
        if self.frames == 0 {
            return Ok(());
        }
        self.run(end_cluster)
    }

    /// [`Self::flush`], and syncs the file: a power cut after this loses none of them.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn sync(&mut self) -> Result<(), VideoError> {
        self.flush()?;
        let synced = self.file.sync_data();
        synced.map_err(|source| self.refused(source))
    }

    /// Ends the file: adds the index that players use to seek, and syncs it. The file can be read
    /// even if this fails.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn finish(mut self) -> Result<(), VideoError> {
        if matches!(self.state, State::Running(_)) {
            self.run(|output| output.write_trailer())?;
            // FFmpeg writes its last bytes when the output is dropped.
            self.state = State::Broken;
            self.check()?;
        }
        let synced = self.file.sync_all();
        synced.map_err(|source| self.refused(source))
    }

    /// Writes the header.
    fn begin(&mut self) -> Result<(), VideoError> {
        let State::Waiting(io) = std::mem::replace(&mut self.state, State::Broken) else {
            return Ok(());
        };
        let extradata = self.sets.extradata();
        let begun = open(
            io,
            &self.stream,
            self.encoder.as_ref(),
            extradata.as_deref(),
        );
        let output = begun.map_err(|why| self.failed(why))?;
        self.state = State::Running(output);
        self.check()
    }

    fn encode(&mut self, data: &[u8], ms: i64) -> Result<Packet, VideoError> {
        let (format, width, height) = (self.stream.format, self.stream.width, self.stream.height);
        let frame = lossless::frame(format, data, width, height);
        let mut frame = frame.ok_or_else(|| {
            let (found, wanted) = (data.len(), format.frame_bytes(width, height).unwrap_or(0));
            VideoError::Refused(format!(
                "a picture of {width} x {height} pixels has {found} bytes instead of {wanted}: the camera sends another size than agreed, or half a picture"
            ))
        })?;
        frame.set_pts(Some(ms));
        let mut packet = Packet::empty();
        let coded = match &mut self.encoder {
            Some(encoder) => encoder
                .send_frame(&frame)
                .and_then(|()| encoder.receive_packet(&mut packet)),
            None => Err(ffmpeg_next::Error::EncoderNotFound),
        };
        coded.map_err(|why| self.failed(why))?;
        Ok(packet)
    }

    /// Calls FFmpeg, and checks whether the system accepted what it wrote.
    fn run(
        &mut self,
        work: impl FnOnce(&mut Output) -> Result<(), ffmpeg_next::Error>,
    ) -> Result<(), VideoError> {
        let done = match &mut self.state {
            State::Running(output) => work(output),
            State::Waiting(_) | State::Broken => Err(ffmpeg_next::Error::Exit),
        };
        self.check()?;
        done.map_err(|why| self.failed(why))
    }

    fn check(&mut self) -> Result<(), VideoError> {
        match self.refusal.take() {
            None => Ok(()),
            Some(source) => {
                self.state = State::Broken;
                Err(self.refused(source))
            }
        }
    }

    fn failed(&self, why: ffmpeg_next::Error) -> VideoError {
        not_created(&self.path, why)
    }

    /// The error for a write that the system refused.
    fn refused(&self, source: io::Error) -> VideoError {
        let path = self.path.clone();
        if is_full(&source) {
            let kept = self.file.metadata().map_or(0, |data| data.len());
            let missing = self.taken.saturating_sub(kept).max(1);
            return VideoError::DiskFull {
                path,
                missing,
                source,
            };
        }
        VideoError::Write { path, source }
    }
}

fn not_created(path: &Path, why: ffmpeg_next::Error) -> VideoError {
    VideoError::Refused(format!(
        "{} could not be created ({why}): does this FFmpeg write Matroska and FFV1?",
        path.display()
    ))
}
