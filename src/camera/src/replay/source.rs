//! The source of a replay's frames: the file's own packets, or a thread that decodes.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread;

use super::CameraError;
use relit_video::{CodedFrame, DecodeFault, Packets, Pending, PixelFormat, Video};

/// Decoded frames that may wait to be fetched.
const AHEAD: usize = 4;
/// Threads of a decoder that decodes ahead.
const DECODING_THREADS: usize = 2;

/// How a video's frames are delivered.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Delivery {
    pub(super) format: PixelFormat,
    /// False if frames are delivered as they are coded in the file.
    decoded: bool,
}

#[derive(Debug)]
pub(super) enum Source {
    Coded(Packets),
    Decoded(Receiver<CodedFrame>),
}

impl Delivery {
    /// As the file has the frames, if a camera could send them so; otherwise decoded.
    pub(super) fn from_video(video: &Video) -> Result<Self, CameraError> {
        let facts = video.facts();
        let coded = match (facts.codec.as_str(), facts.pixel_format.as_str()) {
            ("mjpeg", _) => Some(PixelFormat::Mjpeg),
            ("h264", _) => Some(PixelFormat::H264),
            ("rawvideo", "yuyv422") => Some(PixelFormat::Yuyv),
            ("rawvideo", "nv12") => Some(PixelFormat::Nv12),
            ("rawvideo", "rgb24") => Some(PixelFormat::Rgb24),
            ("rawvideo", "gray") => Some(PixelFormat::Grey),
            _ => None,
        };
        Ok(match coded.filter(|_| video.is_in_order()) {
            Some(format) => Self {
                format,
                decoded: false,
            },
            None => Self {
                format: first_format(video)?,
                decoded: true,
            },
        })
    }

    /// Width and height of the delivered frames; decoded frames are rotated for display.
    pub(super) fn size(self, video: &Video) -> (u32, u32) {
        if self.decoded {
            (video.facts().width, video.facts().height)
        } else {
            video.coded_size()
        }
    }

    /// Frames from the first on.
    pub(super) fn open(self, video: &Arc<Video>) -> Result<Source, CameraError> {
        if !self.decoded {
            return Ok(Source::Coded(video.packets()?));
        }
        let (sender, receiver) = sync_channel(AHEAD);
        let owned = Arc::clone(video);
        let decoder = thread::Builder::new().name("replay".to_owned());
        // The thread ends at the end of the video, or when the receiver is dropped.
        let started = decoder.spawn(move || decode(&owned, self.format, &sender));
        started.map_err(|error| CameraError::Replay {
            path: video.path().to_owned(),
            why: format!("no thread could be started to decode it ({error}); close other programs"),
        })?;
        Ok(Source::Decoded(receiver))
    }
}

impl Source {
    /// The next frame; `None` at the end.
    pub(super) fn next(&mut self) -> Option<CodedFrame> {
        match self {
            Self::Coded(packets) => packets.next(),
            Self::Decoded(frames) => frames.recv().ok(),
        }
    }
}

/// Decodes all frames in order. One that cannot be decoded is left out, like a frame that a camera
/// dropped: its counter is then missing.
fn decode(video: &Video, format: PixelFormat, sender: &SyncSender<CodedFrame>) {
    let wanted: Vec<u64> = (0..video.frames().len() as u64).collect();
    let Ok(reader) = video.read(&wanted, DECODING_THREADS) else {
        return;
    };
    let mut due = 0;
    for pending in reader {
        let number = pending.number();
        match raw(video, pending) {
            // Lost frames may come late.
            Ok((found, data)) if found == format && number >= due => {
                due = number + 1;
                let frame = CodedFrame {
                    number,
                    data,
                    key: true,
                    damaged: false,
                };
                if sender.send(frame).is_err() {
                    return;
                }
            }
            Ok(_) | Err(_) => {}
        }
    }
}

fn raw(video: &Video, pending: Pending) -> Result<(PixelFormat, Vec<u8>), DecodeFault> {
    video.picture(pending)?.raw()
}

/// The raw format of the first frame that can be decoded.
fn first_format(video: &Video) -> Result<PixelFormat, CameraError> {
    let wanted: Vec<u64> = (0..video.frames().len() as u64).collect();
    let mut reader = video.read(&wanted, 1)?;
    let found = reader.find_map(|pending| raw(video, pending).ok());
    found
        .map(|(format, _)| format)
        .ok_or_else(|| CameraError::Replay {
            path: video.path().to_owned(),
            why: "none of its frames can be decoded; give another recording".to_owned(),
        })
}
