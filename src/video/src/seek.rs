//! Reading one frame of a video without everything before it.

use std::cmp::Ordering;
use std::path::Path;

use ffmpeg_next::codec::Parameters;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::{Packet, frame, media};
use image::RgbImage;
use image::metadata::Orientation as Exif;

use super::colour::{Colour, ColourProperties};
use super::decoder::{self as opening, VideoDecoder};
use super::display::Display;
use super::photograph::exif_orientation;
use super::picture::Picture;
use super::scan::Video;
use super::{DecodeFault, VideoError, open_input};
use relit_data::geometry::Rect;

/// Packets that are read in search of one frame: more than lie between two key frames.
const MAX_PACKETS: usize = 600;

/// The first picture of a video that can be decoded. Unlike [`Video::open`] it reads no further, so
/// that the time it takes does not grow with the file.
///
/// # Errors
/// As [`Video::open`]; also where nothing at the file's beginning can be decoded.
pub fn first_picture(path: &Path) -> Result<RgbImage, VideoError> {
    let mut opened = OpenedStream::open(path)?;
    let frame = first_frame(&mut opened.input, opened.stream, &mut opened.decoder);
    let frame = frame.ok_or_else(|| no_frames(path))?;
    let (colour, display, ..) = opened.shown(path, Some(&frame))?;
    let picture = Picture::new(0, frame, colour, display);
    let (width, height) = picture.size();
    let wrong = |fault: DecodeFault| VideoError::Frame {
        path: path.to_owned(),
        number: 0,
        fault,
    };
    picture.rgb(Rect::new(0, 0, width, height)).map_err(wrong)
}

pub(super) fn no_frames(path: &Path) -> VideoError {
    let why = "has no complete frame: it was truncated too early; record it again";
    VideoError::unreadable(path, why)
}

/// A file's stream of pictures, and a decoder for it.
pub(super) struct OpenedStream {
    pub(super) input: Input,
    pub(super) stream: usize,
    /// The codec's name in FFmpeg.
    pub(super) codec: String,
    pub(super) decoder: VideoDecoder,
}

impl OpenedStream {
    pub(super) fn open(path: &Path) -> Result<Self, VideoError> {
        let input = open_input(path)?;
        let best = input.streams().best(media::Type::Video);
        let best = best.ok_or_else(|| VideoError::no_video(path))?;
        let (stream, parameters) = (best.index(), best.parameters());
        let codec = format!("{:?}", parameters.id());
        let decoder = opening::open(parameters, 1).map_err(VideoError::decoder(path, &codec))?;
        Ok(Self {
            input,
            stream,
            codec,
            decoder,
        })
    }

    /// How its pictures are shown, by what the first of them states, or else the stream; how a photograph is turned by
    /// Exif; and remarks.
    pub(super) fn shown(
        &self,
        path: &Path,
        first: Option<&frame::Video>,
    ) -> Result<(Colour, Display, Option<Exif>, Vec<String>), VideoError> {
        let by_stream = ColourProperties::by_stream(&self.decoder);
        let stated = first.map_or(by_stream, |first| {
            ColourProperties::by_picture(first).or(by_stream)
        });
        let colour = stated.colour().map_err(|fault| {
            let why = format!(
                "has other colours than SDR: {fault} cannot be converted to sRGB: convert the video to SDR with BT.709 colours first"
            );
            VideoError::unreadable(path, why)
        })?;
        let exif = exif_orientation(&self.input, path);
        let stream = self.input.stream(self.stream);
        let stream = stream.ok_or_else(|| VideoError::no_video(path))?;
        let (display, notes) = Display::from_frame(&self.input, &stream, first, exif);
        Ok((colour, display, exif, notes))
    }
}

impl Video {
    /// The picture of a frame, found by the container's own index. `None` if that fails or the result
    /// is doubtful; the caller then reads from the start.
    pub(super) fn picture_by_index(&self, number: u64) -> Option<Picture> {
        if !self.track.stamps_are_unique() {
            return None;
        }
        let at = usize::try_from(number).ok()?;
        let info = *self.frames().get(at)?;
        let wanted = (*self.track.stamps.get(at)?)?;
        let mut input = open_input(self.path()).ok()?;
        input.seek(info.t_us, ..info.t_us.saturating_add(1)).ok()?;
        let parameters: Parameters = input.stream(self.track.stream)?.parameters();
        let mut decoder = opening::open(parameters, 1).ok()?;
        // What the container's index takes for a key frame may be a recovery point.
        let is_begin = |packet: &Packet| {
            let number = self.track.number_of(packet.pts(), 0);
            number.is_some_and(|number| self.track.is_key(number))
        };
        let stream = self.track.stream;
        let frame = search(&mut input, stream, &mut decoder, is_begin, |frame| {
            let stamp = frame.timestamp().or_else(|| frame.pts());
            match stamp.map(|stamp| stamp.cmp(&wanted)) {
                // What builds on a damaged frame is not taken.
                _ if !is_whole(frame) => Found::Nothing,
                Some(Ordering::Equal) => Found::This,
                Some(Ordering::Less) => Found::Earlier,
                Some(Ordering::Greater) | None => Found::Nothing,
            }
        })?;
        self.track.picture(number, frame).ok()
    }
}

fn is_whole(frame: &frame::Video) -> bool {
    !frame.is_corrupt() && !frame.has_decode_errors()
}

/// The first frame of a stream that can be decoded.
pub(super) fn first_frame(
    input: &mut Input,
    stream: usize,
    decoder: &mut VideoDecoder,
) -> Option<frame::Video> {
    search(
        input,
        stream,
        decoder,
        |_| true,
        |frame| {
            if is_whole(frame) {
                Found::This
            } else {
                Found::Earlier
            }
        },
    )
}

/// What a search does with a decoded frame.
enum Found {
    This,
    Earlier,
    Nothing,
}

/// Decodes on from where the input stands, if decoding can begin with its first packet, up to the frame that `judge` takes
/// by its time stamp.
fn search(
    input: &mut Input,
    stream: usize,
    decoder: &mut VideoDecoder,
    is_begin: impl Fn(&Packet) -> bool,
    judge: impl Fn(&frame::Video) -> Found,
) -> Option<frame::Video> {
    let (mut begun, mut ended) = (false, false);
    for _ in 0..MAX_PACKETS {
        // A packet that is read into again would keep the memory of what it held.
        let mut packet = Packet::empty();
        match packet.read(input) {
            Ok(()) if packet.stream() != stream || packet.size() == 0 => continue,
            Ok(()) if !begun && !is_begin(&packet) => return None,
            // A damaged packet gives no frame; the next ones may.
            Ok(()) => drop(decoder.send_packet(&packet)),
            Err(_) => {
                decoder.send_eof().ok()?;
                ended = true;
            }
        }
        begun = true;
        let mut picture = frame::Video::empty();
        while decoder.receive_frame(&mut picture).is_ok() {
            match judge(&picture) {
                Found::This => return Some(picture),
                Found::Earlier => {}
                Found::Nothing => return None,
            }
        }
        if ended {
            return None;
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fixture(name: &str) -> std::path::PathBuf {
        let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
        fixtures.join(name).join("video.mkv")
    }

    #[test]
    fn a_frame_that_is_sought_is_the_one_that_reading_from_the_start_gives() {
        for name in ["20261120T093015Z-cow", "20261120T103000Z-cow-dropped"] {
            let video = Video::open(&fixture(name)).unwrap();
            let last = video.frames().len() as u64 - 1;
            let numbers = [0, 1, 29, 30, 31, last / 2, last - 1, last];
            for (pending, number) in video.read(&numbers, 1).unwrap().zip(numbers) {
                let read = video.picture(pending).unwrap();
                let picture_by_index = video.picture_by_index(number).unwrap();
                let (w, h) = read.size();
                let all = Rect::new(0, 0, w, h);
                assert_eq!(picture_by_index.number(), number);
                assert!(
                    picture_by_index.rgb(all).unwrap() == read.rgb(all).unwrap(),
                    "{name} {number}"
                );
            }
            assert!(video.picture_by_index(last + 1).is_none());
        }
    }

    #[test]
    fn the_first_picture_is_that_of_frame_0_also_of_a_file_that_was_cut() {
        for name in ["20261120T101500Z-cow-short", "20261120T104500Z-cow-cut"] {
            let first = first_picture(&fixture(name)).unwrap();
            let video = Video::open(&fixture(name)).unwrap();
            assert!(first == video.frame(0).unwrap(), "{name}");
        }
        assert!(matches!(
            first_picture(&fixture("no such session")),
            Err(VideoError::Unreadable { .. })
        ));
    }
}
