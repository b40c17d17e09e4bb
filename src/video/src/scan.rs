//! Reading through a video once without decoding: which frames it has, and whether it is whole.

use std::fs::File;
use std::io::BufReader;
use std::ops::Range;
use std::path::{Path, PathBuf};

use ffmpeg_next::codec::Parameters;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::format::stream::Stream;
use ffmpeg_next::{Packet, Rational, ffi};
use image::RgbImage;
use image::metadata::Orientation as Exif;

use super::colour::Colour;
use super::decoder::{Pool, VideoDecoder};
use super::display::Display;
use super::order::{
    FrameInfo, PresentationOrder, Stamp, mark_wrong_checksums, microseconds, needs_decoding,
};
use super::packet_contents::Inspector;
use super::seek::{OpenedStream, first_frame, no_frames};
use super::survey::Survey;
use super::track::{Numbering, Track};
use super::{DecodeFault, Pending, Reader, Truncation, VideoError, find_truncation, open_input};
use relit_data::geometry::Rect;

/// Codec, size and colour of a video.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Facts {
    /// The codec's name, such as `mjpeg`.
    pub codec: String,
    /// Width as displayed, pixels.
    pub width: u32,
    /// Height as displayed, pixels.
    pub height: u32,
    /// Width and height in the file's own pixels, turned for display; others where these are not square.
    pub stored_size: (u32, u32),
    /// FFmpeg's name of the pixel format, such as `yuvj422p`.
    pub pixel_format: String,
    /// True where black is 0 and white is 255; false where they are 16 and 235 and are expanded.
    pub full_range: bool,
    /// Exif's number, 2 to 8, by which a photograph is turned for display; none for a video, and for a photograph that is
    /// displayed as it is stored.
    pub exif_orientation: Option<u8>,
    /// How the colours are converted to sRGB, in words; none for SDR with BT.709 primaries, which is taken as sRGB.
    pub colour_conversion: Option<String>,
}

/// A video file that was read through once.
pub struct Video {
    path: PathBuf,
    facts: Facts,
    frames: Vec<FrameInfo>,
    damage: Vec<String>,
    notes: Vec<String>,
    pub(super) track: Track,
    pub(super) pool: Pool,
}

impl std::fmt::Debug for Video {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Video")
            .field("path", &self.path)
            .field("facts", &self.facts)
            .finish()
    }
}

impl Video {
    /// Opens a file and reads through it once.
    ///
    /// # Errors
    /// [`VideoError::Unreadable`]. A file that is damaged but has frames is opened; see [`Self::damage`].
    pub fn open(path: &Path) -> Result<Self, VideoError> {
        let mut opened = OpenedStream::open(path)?;
        let stream = opened.input.stream(opened.stream);
        let stream = stream.ok_or_else(|| VideoError::no_video(path))?;
        let (time_base, rate) = (stream.time_base(), stream.avg_frame_rate());
        let promised = Promised::new(&opened.input, &stream);
        let (index, parameters) = (opened.stream, stream.parameters());

        let mut packets = read_through(&mut opened.input, index, &parameters);
        mark_wrong_checksums(&mut packets.stamps);
        let stamps = &packets.stamps;
        let mut refused = 0;
        let (ordered, numbering) = if packets.are_pictures || !needs_decoding(stamps) {
            let ordered = PresentationOrder::from(stamps, time_base, rate);
            let numbering = if ordered.stamps_are_unique() {
                Numbering::Stamps
            } else {
                Numbering::Packets
            };
            (ordered, numbering)
        } else {
            let survey = Survey::decode(path, (index, stamps.len()), &opened.codec)?;
            refused = survey.refused;
            let pictures = survey.pictures();
            let ordered = PresentationOrder::from_pictures(&pictures, stamps, time_base, rate);
            (ordered, Numbering::Decoder(survey.faults))
        };
        if ordered.frames.is_empty() {
            return Err(no_frames(path));
        }
        let first = open_input(path).ok();
        let first = first.and_then(|mut input| first_frame(&mut input, index, &mut opened.decoder));
        let (colour, display, exif, mut notes) = opened.shown(path, first.as_ref())?;
        let decoder = &opened.decoder;
        notes.extend(ordered.note);
        notes.extend(display.note(decoder.width(), decoder.height()));
        notes.extend(colour.notes());
        let coded = (decoder.width(), decoder.height());
        Ok(Self {
            path: path.to_owned(),
            facts: facts(decoder, &colour, display, exif),
            damage: find_damage(path, &ordered.frames, &packets, refused, &promised),
            frames: ordered.frames,
            notes,
            track: Track {
                stream: index,
                codec: decoder.id(),
                coded,
                colour,
                display,
                numbering,
                number_of_packet: ordered.number_of_packet,
                stamps: ordered.stamps,
                keys: ordered.keys,
            },
            pool: Pool::new(parameters),
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Codec, size and colour.
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// All frames in order of presentation; `frames()[i].number == i`.
    pub fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    /// Numbers of the frames that can be decoded without any other, sorted: all of Motion JPEG, the key frames of
    /// H.264; `None` if only a decoder tells which frames there are. A [`Reader`] that is asked for none but these decodes
    /// no other.
    pub fn key_frames(&self) -> &[u64] {
        &self.track.keys
    }

    /// A frame and those after it, up to the next that can be decoded without any other; the frame alone, if only a decoder
    /// tells which frames there are.
    pub fn until_next_key(&self, number: u64) -> Range<u64> {
        let keys = self.key_frames();
        if keys.is_empty() {
            return number..number + 1;
        }
        let next = keys.partition_point(|&key| key <= number);
        let end = keys.get(next).copied();
        number..end.unwrap_or(self.frames().len() as u64)
    }

    /// Signs that the file is incomplete or damaged, one phrase each; empty if there are none.
    pub fn damage(&self) -> &[String] {
        &self.damage
    }

    /// What had to be assumed about the file, for its user.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Reads the frames whose numbers are in `wanted` (in any order, doubled or not), with
    /// `threads` threads where FFmpeg decodes ahead itself.
    ///
    /// # Errors
    /// [`VideoError::NoSuchFrame`], or what opening the file again answers.
    pub fn read(&self, wanted: &[u64], threads: usize) -> Result<Reader<'_>, VideoError> {
        let last = self.frames.len() as u64 - 1;
        if let Some(&number) = wanted.iter().find(|&&number| number > last) {
            return Err(VideoError::NoSuchFrame {
                path: self.path.clone(),
                number,
                last,
            });
        }
        Reader::open(&self.path, &self.facts.codec, &self.track, wanted, threads)
    }

    /// Decodes one frame to RGB, as displayed.
    ///
    /// # Errors
    /// [`VideoError::NoSuchFrame`], [`VideoError::Frame`], or what opening the file again answers.
    pub fn frame(&self, number: u64) -> Result<RgbImage, VideoError> {
        let wrong = |fault| VideoError::Frame {
            path: self.path.clone(),
            number,
            fault,
        };
        let mut reader = self.read(&[number], 1)?;
        if self
            .frames
            .iter()
            .any(|frame| frame.number == number && frame.damaged)
        {
            return Err(wrong(DecodeFault::not_whole()));
        }
        let all = Rect::new(0, 0, self.facts.width, self.facts.height);
        if let Some(picture) = self.picture_by_index(number) {
            return picture.rgb(all).map_err(wrong);
        }
        let pending = reader
            .next()
            .ok_or_else(|| wrong(DecodeFault::no_picture()))?;
        self.picture(pending)
            .and_then(|picture| picture.rgb(all))
            .map_err(wrong)
    }

    /// Decodes what a [`Reader`] of this video handed out. May be called from many threads at
    /// once.
    ///
    /// # Errors
    /// [`DecodeFault`] where the frame yields no picture.
    pub fn picture(&self, pending: Pending) -> Result<super::Picture, DecodeFault> {
        pending.decode(&self.track, &self.pool)
    }
}

fn facts(decoder: &VideoDecoder, colour: &Colour, display: Display, exif: Option<Exif>) -> Facts {
    let (width, height) = display.displayed(decoder.width(), decoder.height());
    let codec = decoder.codec().map(|codec| codec.name().to_owned());
    let format = decoder
        .format()
        .descriptor()
        .map(|format| format.name().to_owned());
    Facts {
        codec: codec.unwrap_or_else(|| format!("{:?}", decoder.id())),
        width,
        height,
        stored_size: display.stored(decoder.width(), decoder.height()),
        pixel_format: format.unwrap_or_else(|| "unknown".to_owned()),
        full_range: colour.full_range,
        exif_orientation: exif.map(Exif::to_exif),
        colour_conversion: colour.conversion(),
    }
}

/// What reading through a file found.
struct FoundPackets {
    /// The stream's packets, in the order of the file.
    stamps: Vec<Stamp>,
    /// Whether each of them is a picture, whatever stands in it.
    are_pictures: bool,
    /// When the last of all streams ends, microseconds.
    end_us: i64,
    error: Option<ffmpeg_next::Error>,
}

fn read_through(input: &mut Input, stream: usize, parameters: &Parameters) -> FoundPackets {
    let bases: Vec<Rational> = input.streams().map(|stream| stream.time_base()).collect();
    let mut inspector = Inspector::new(parameters);
    let mut found = FoundPackets {
        stamps: Vec::new(),
        are_pictures: inspector.packets_are_pictures(),
        end_us: i64::MIN,
        error: None,
    };
    loop {
        // A packet that is read into again would keep the memory of what it held.
        let mut packet = Packet::empty();
        match packet.read(input) {
            Ok(()) => {}
            Err(ffmpeg_next::Error::Eof) => return found,
            Err(why) => {
                found.error = Some(why);
                return found;
            }
        }
        if let (Some(at), Some(&base)) = (packet.pts().or(packet.dts()), bases.get(packet.stream()))
        {
            let end = at.saturating_add(packet.duration().max(0));
            found.end_us = found.end_us.max(microseconds(end, base));
        }
        if packet.stream() == stream && packet.size() > 0 {
            let stamp = Stamp::from_packet(&packet, parameters.id(), &mut inspector);
            found.stamps.push(stamp);
        }
    }
}

/// The length that the container states; 0 if it states none.
struct Promised {
    packets: u64,
    duration_us: i64,
}

impl Promised {
    #[allow(unsafe_code)]
    fn new(input: &Input, stream: &Stream<'_>) -> Self {
        // SAFETY: the function reads the length of a live stream's index.
        let indexed = unsafe { ffi::avformat_index_get_entries_count(stream.as_ptr()) };
        let packets = match input.format().name() {
            // AVI counts empty chunks, too.
            "avi" => 0,
            // The frames that are stored; a trimmed clip's index has those that belong to it.
            name if name.contains("mp4") => i64::from(indexed),
            _ => stream.frames(),
        };
        Self {
            packets: u64::try_from(packets).unwrap_or(0),
            duration_us: input.duration(),
        }
    }
}

fn find_damage(
    path: &Path,
    frames: &[FrameInfo],
    packets: &FoundPackets,
    refused: u64,
    promised: &Promised,
) -> Vec<String> {
    let found = frames.len();
    let mut damage = Vec::new();
    let cut = File::open(path).and_then(|file| find_truncation(&mut BufReader::new(file)));
    if let Ok(Some(Truncation {
        element_at,
        missing,
    })) = cut
    {
        let what = match missing {
            Some(1) => "1 byte is missing in".to_owned(),
            Some(n) => format!("{n} bytes are missing in"),
            None => "a part is missing or damaged in".to_owned(),
        };
        damage.push(format!(
            "truncated: {what} the element at byte {element_at}"
        ));
    }
    if let Some(why) = packets.error {
        damage.push(format!("reading stopped after {found} frames: {why}"));
    }
    let (promised_packets, read) = (promised.packets, packets.stamps.len() as u64);
    if promised_packets > read {
        damage.push(format!(
            "the file promises {promised_packets} frames and holds {read}"
        ));
    }
    if refused > 0 {
        damage.push(format!("the decoder refuses {refused} packets of the file"));
    }
    let mut damaged = frames.iter().filter(|frame| frame.damaged);
    if let Some(first) = damaged.next() {
        damage.push(format!(
            "{} frames are damaged in the file, the first is frame {}",
            1 + damaged.count(),
            first.number
        ));
    }
    damage.extend(shorter(frames, packets.end_us, promised.duration_us));
    damage
}

/// Whether the file is shorter than it promises. A slow last frame is not damage; a tenth of the length is.
fn shorter(frames: &[FrameInfo], end_us: i64, promised_us: i64) -> Option<String> {
    let [first, .., last] = frames else {
        return None;
    };
    let step = last.t_us.saturating_sub(first.t_us) / (frames.len() as i64 - 1);
    // The promise counts from the first time stamp, which can be negative, and holds for all streams.
    let span = end_us.saturating_sub(first.t_us.min(0));
    let found_us = span.max(last.t_us.saturating_add(step));
    let tolerance = promised_us / 10 + step.saturating_mul(2);
    (promised_us > found_us.saturating_add(tolerance)).then(|| {
        let [promised, found] = [promised_us, found_us].map(|time| time as f64 / 1e6);
        format!("the file promises {promised:.3} s and its frames end at {found:.3} s")
    })
}
