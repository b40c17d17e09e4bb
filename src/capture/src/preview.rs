//! The preview: the camera's newest frame as a JPEG, and what it says of exposure and focus.
//!
//! ```text
//! camera -> publish (never waits) -> a thread -> the monitor's newest picture -> subscribers
//! ```
//!
//! Frames that have to be encoded are encoded while somebody [watches](Monitor::is_watched), and once
//! a second otherwise. Whoever publishes is never held up: where the thread is busy, a frame is passed
//! over. Frames that build on others (H.264) are decoded one after the other; after a frame that was
//! passed over, pictures go on with the next key frame.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::time::{Duration, Instant};

use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;

use crate::state::Monitor;
use relit_camera::Frame;
use relit_data::geometry::Rect;
use relit_data::image_stats::{SATURATION_LEVEL, measure_whole};
use relit_video::{LiveDecoder, Picture, PixelFormat, is_key};

/// Frames that wait for the thread.
const WAITING: usize = 8;
/// Shortest time between two pictures, and the longest between two that nobody waits for.
const PICTURES: Duration = Duration::from_millis(100);
const UNWATCHED: Duration = Duration::from_secs(1);
/// Shortest time between two measurements of exposure and focus.
const FIGURES: Duration = Duration::from_millis(500);
/// Quality of pictures that the camera did not deliver as JPEG, per cent.
const QUALITY: u8 = 80;

/// Where frames are published for the viewers of a monitor. The thread behind it ends with the last
/// copy.
#[derive(Debug, Clone)]
pub struct Preview {
    frames: SyncSender<Arc<Frame>>,
}

impl Preview {
    /// Starts the thread that shows frames in `monitor`.
    ///
    /// # Errors
    /// What the system answers.
    pub fn start(monitor: Monitor) -> io::Result<Self> {
        let (frames, queue): (_, Receiver<Arc<Frame>>) = sync_channel(WAITING);
        let mut encoder = PreviewEncoder::new(monitor);
        std::thread::Builder::new()
            .name("relit-preview".to_owned())
            .spawn(move || {
                for frame in queue {
                    encoder.take(&frame, Instant::now());
                }
            })?;
        Ok(Self { frames })
    }

    /// Publishes a frame; returns at once.
    pub fn publish(&self, frame: &Arc<Frame>) {
        let _ = self.frames.try_send(Arc::clone(frame));
    }
}

/// Makes pictures and figures of frames.
struct PreviewEncoder {
    monitor: Monitor,
    decoder: Option<(PixelFormat, u32, u32, LiveDecoder)>,
    /// When the last picture was shown and the last figures were taken.
    shown: Option<Instant>,
    measured: Option<Instant>,
    /// Counter of the last frame of a chain that was decoded.
    chain: Option<u64>,
}

impl PreviewEncoder {
    fn new(monitor: Monitor) -> Self {
        Self {
            monitor,
            decoder: None,
            shown: None,
            measured: None,
            chain: None,
        }
    }

    /// Takes a frame that came at `now`.
    fn take(&mut self, frame: &Frame, now: Instant) {
        let Some(format) = frame.fourcc.pixel_format() else {
            return;
        };
        let since = |last: Option<Instant>| last.map_or(Duration::MAX, |last| now - last);
        let is_jpeg = format == PixelFormat::Mjpeg && has_tables(&frame.data);
        let is_free = is_jpeg || self.monitor.is_watched();
        let show = since(self.shown) >= if is_free { PICTURES } else { UNWATCHED };
        let measure = since(self.measured) >= FIGURES;
        let chained = format == PixelFormat::H264;
        if !(show || measure || chained) || frame.fault().is_some() {
            return;
        }
        let mut jpeg: Option<Arc<[u8]>> = (show && is_jpeg).then(|| frame.data.as_slice().into());
        if (measure || chained || !is_jpeg)
            && let Some(rgb) = self.decode(format, frame)
        {
            if measure {
                self.measure(&rgb);
                self.measured = Some(now);
            }
            if show && !is_jpeg {
                jpeg = jpeg_of(&rgb);
            }
        }
        if let Some(jpeg) = jpeg {
            self.monitor.show(frame.t_us, jpeg);
            self.shown = Some(now);
        }
    }

    fn measure(&self, rgb: &RgbImage) {
        let Rect { x, y, w, h } = Rect::middle_of(rgb.width(), rgb.height());
        let (x, y) = (x.unsigned_abs(), y.unsigned_abs());
        let middle = image::imageops::crop_imm(rgb, x, y, w, h).to_image();
        let clipped = measure_whole(rgb, SATURATION_LEVEL).saturated_fraction();
        let focus = measure_whole(&middle, SATURATION_LEVEL).sharpness;
        self.monitor.update(|state| {
            state.camera.clipped = Some(clipped);
            state.camera.focus = Some(focus);
        });
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
        let follows = match (self.chain, frame.sequence) {
            (Some(last), Some(number)) => number == last + 1,
            _ => false,
        };
        if follows || is_key(&frame.data) {
            self.chain = frame.sequence;
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

/// A picture as it is.
pub(crate) fn whole(picture: &Picture) -> Option<RgbImage> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::capture::tests::frame;

    /// Pictures that are made of a camera's raw frames in two seconds.
    fn pictures(is_watched: bool) -> u64 {
        let monitor = Monitor::default();
        let _viewer = is_watched.then(|| monitor.pictures());
        let mut encoder = PreviewEncoder::new(monitor.clone());
        let began = Instant::now();
        for n in 0..60 {
            encoder.take(&frame(n), began + Duration::from_micros(33_333 * n));
        }
        monitor.preview().unwrap().number
    }

    #[test]
    fn raw_frames_are_encoded_ten_times_a_second_while_watched_and_once_otherwise() {
        assert_eq!((pictures(true), pictures(false)), (15, 2));
    }

    #[test]
    fn figures_are_taken_whether_anybody_watches_or_not() {
        let monitor = Monitor::default();
        let mut encoder = PreviewEncoder::new(monitor.clone());
        encoder.take(&frame(250), Instant::now());
        let camera = monitor.state().camera;
        assert_eq!((camera.clipped, camera.focus), (Some(1.0), Some(0.0)));
    }
}
