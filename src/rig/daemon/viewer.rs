//! Pictures for people: the newest frame as a JPEG, and what it tells of exposure and focus.
//!
//! A thread of its own does the work on the newest frame that it was offered; whoever offers one
//! never waits. Frames that build on others (H.264) are all kept for the decoder while nothing is
//! recorded; while frames are passed over, pictures come with key frames.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;

use crate::camera::Frame;
use crate::capture::look::{clipped, focus, middle};
use crate::state::Monitor;
use relit_data::geometry::Rect;
use relit_video::{LiveDecoder, Picture, PixelFormat, is_key};

/// Frames that wait for the viewer's thread.
const WAITING: usize = 8;
/// Pictures are shown no oftener than this: ten a second.
const SHOWING: Duration = Duration::from_millis(100);
/// Figures are taken no oftener than this: twice a second.
const FIGURING: Duration = Duration::from_millis(500);
/// Quality of pictures that the camera did not deliver as JPEG, per cent.
const QUALITY: u8 = 80;
/// How long a thread without frames waits until it looks whether anybody is left.
const IDLE: Duration = Duration::from_millis(500);

/// Shows frames to the viewers of a monitor.
#[derive(Debug)]
pub struct Viewer {
    frames: Option<SyncSender<Arc<Frame>>>,
    thread: Option<JoinHandle<()>>,
}

impl Viewer {
    /// Starts the thread.
    ///
    /// # Errors
    /// What the system answers.
    pub fn start(monitor: Monitor) -> io::Result<Self> {
        let (frames, queue) = sync_channel(WAITING);
        let thread = std::thread::Builder::new()
            .name("relit-viewer".to_owned())
            .spawn(move || Showing::new(monitor).run(&queue))?;
        Ok(Self {
            frames: Some(frames),
            thread: Some(thread),
        })
    }

    /// Offers a frame. Where the thread is still busy with others it is passed over.
    pub fn offer(&self, frame: &Arc<Frame>) {
        if let Some(frames) = &self.frames {
            let _ = frames.try_send(Arc::clone(frame));
        }
    }
}

impl Drop for Viewer {
    fn drop(&mut self) {
        self.frames = None;
        if let Some(thread) = self.thread.take() {
            // A panic in there was told by the thread itself, and costs pictures only.
            let _ = thread.join();
        }
    }
}

/// The thread's own.
struct Showing {
    monitor: Monitor,
    decoder: Option<(PixelFormat, u32, u32, LiveDecoder)>,
    shown: Option<Instant>,
    figured: Option<Instant>,
    /// Counter of the last frame of a chain that was decoded.
    chain: Option<u64>,
}

impl Showing {
    fn new(monitor: Monitor) -> Self {
        Self {
            monitor,
            decoder: None,
            shown: None,
            figured: None,
            chain: None,
        }
    }

    fn run(mut self, queue: &Receiver<Arc<Frame>>) {
        loop {
            match queue.recv_timeout(IDLE) {
                Ok(frame) => self.take(&frame),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn take(&mut self, frame: &Frame) {
        let Some(format) = frame.fourcc.pixel_format() else {
            return;
        };
        let show = due(self.shown, SHOWING);
        let figure = due(self.figured, FIGURING);
        let chained = format == PixelFormat::H264;
        if !(show || figure || chained) || frame.fault().is_some() {
            return;
        }
        let as_it_is = format == PixelFormat::Mjpeg && has_tables(&frame.data);
        if show && as_it_is {
            self.show(frame, frame.data.as_slice().into());
        }
        if (figure || chained || !as_it_is)
            && let Some(rgb) = self.decode(format, frame)
        {
            if figure {
                self.figure(&rgb);
            }
            if show
                && !as_it_is
                && let Some(jpeg) = jpeg_of(&rgb)
            {
                self.show(frame, jpeg);
            }
        }
    }

    fn show(&mut self, frame: &Frame, jpeg: Arc<[u8]>) {
        self.monitor.show(frame.t_us, jpeg);
        self.shown = Some(Instant::now());
    }

    fn figure(&mut self, rgb: &RgbImage) {
        let Rect { x, y, w, h } = middle(rgb.width(), rgb.height());
        let (x, y) = (x.unsigned_abs(), y.unsigned_abs());
        let inner = image::imageops::crop_imm(rgb, x, y, w, h).to_image();
        let (clipped, focus) = (clipped(rgb), focus(&inner));
        self.monitor.update(|state| {
            state.camera.clipped = Some(clipped);
            state.camera.focus = Some(focus);
        });
        self.figured = Some(Instant::now());
    }

    /// The frame's picture, where it can be had.
    fn decode(&mut self, format: PixelFormat, frame: &Frame) -> Option<RgbImage> {
        if format == PixelFormat::H264 && !self.continues_chain(frame) {
            return None;
        }
        let picture = self.decoder_of(format, frame)?.decode(&frame.data);
        whole(&picture.ok()??)
    }

    /// Whether a frame of a chain can be decoded after those that were.
    fn continues_chain(&mut self, frame: &Frame) -> bool {
        let number = frame.sequence.map(|sequence| sequence.unwrapped);
        let follows = match (self.chain, number) {
            (Some(last), Some(number)) => number == last + 1,
            _ => false,
        };
        if follows || is_key(&frame.data) {
            self.chain = number;
            return true;
        }
        self.chain = None;
        false
    }

    fn decoder_of(&mut self, format: PixelFormat, frame: &Frame) -> Option<&mut LiveDecoder> {
        let kept = self.decoder.take().filter(|(known, width, height, _)| {
            (*known, *width, *height) == (format, frame.width, frame.height)
        });
        let decoder = match kept {
            Some(kept) => kept,
            None => {
                let live = LiveDecoder::new(format, frame.width, frame.height);
                (format, frame.width, frame.height, live.ok()?)
            }
        };
        Some(&mut self.decoder.insert(decoder).3)
    }
}

fn due(last: Option<Instant>, every: Duration) -> bool {
    last.is_none_or(|last| last.elapsed() >= every)
}

fn whole(picture: &Picture) -> Option<RgbImage> {
    let (width, height) = picture.size();
    picture.rgb(Rect::new(0, 0, width, height)).ok()
}

fn jpeg_of(rgb: &RgbImage) -> Option<Arc<[u8]>> {
    let mut jpeg = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut jpeg, QUALITY);
    rgb.write_with_encoder(encoder).ok()?;
    Some(jpeg.into())
}

/// Whether a JPEG brings its Huffman tables. Many cameras leave them out, since Motion JPEG fixes
/// them; browsers then show nothing.
fn has_tables(jpeg: &[u8]) -> bool {
    let head = &jpeg[..jpeg.len().min(4096)];
    head.windows(2).any(|pair| pair == [0xff, 0xc4])
}
