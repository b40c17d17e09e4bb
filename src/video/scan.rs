//! Reading through a video once without decoding: which frames it has, and whether it is whole.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use ffmpeg_next::codec::packet::side_data;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::{Packet, codec, format, media};
use image::RgbImage;
use image::metadata::Orientation as Exif;

use super::decoder::{self, Pool, VideoDecoder};
use super::order::{FrameInfo, Ordered, Stamp, mark_wrong_checksums};
use super::orientation::Orientation;
use super::photograph::exif_orientation;
use super::picture::Colour;
use super::track::Track;
use super::{DecodeFault, Pending, Reader, Truncation, VideoError, find_truncation, open_input};
use relit_data::geometry::Rect;

/// Codec, size and colour of a video.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct Facts {
    /// The codec's name, such as `mjpeg`.
    pub codec: String,
    /// Width as displayed, pixels.
    pub width: u32,
    /// Height as displayed, pixels.
    pub height: u32,
    /// FFmpeg's name of the pixel format, such as `yuvj422p`.
    pub pixel_format: String,
    /// True where black is 0 and white is 255; false where they are 16 and 235 and are expanded.
    pub full_range: bool,
    /// Exif's number, 2 to 8, by which a photograph is turned for display; none for a video, and for a photograph that is
    /// displayed as it is stored.
    pub exif_orientation: Option<u8>,
}

/// A sign that a video is incomplete or damaged.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Damage {
    /// The file ends inside an element, or an element does not fit into its parent.
    #[error(
        "truncated: {what} the element at byte {at}",
        what = missing_words(.0), at = .0.element_at
    )]
    Truncated(Truncation),
    /// The container promises more frames than there are.
    #[error("the file promises {promised} frames and holds {found}")]
    FewerFrames {
        /// The number in the container.
        promised: u64,
        /// The number found.
        found: u64,
    },
    /// The container promises a longer time than its frames cover.
    #[error(
        "the file promises {:.3} s and its frames end at {:.3} s",
        *promised_us as f64 / 1e6, *found_us as f64 / 1e6
    )]
    Shorter {
        /// The duration in the container, microseconds.
        promised_us: i64,
        /// The end of the last frame, microseconds.
        found_us: i64,
    },
    /// Frames whose data the container knows to be damaged.
    #[error("{count} frames are damaged in the file, the first is frame {first}")]
    DamagedFrames {
        /// How many.
        count: u64,
        /// The first one's number.
        first: u64,
    },
    /// Reading stopped with an error.
    #[error("reading stopped after {found} frames: {why}")]
    ReadError {
        /// Frames found up to there.
        found: u64,
        /// FFmpeg's answer.
        why: ffmpeg_next::Error,
    },
}

fn missing_words(truncation: &Truncation) -> String {
    match truncation.missing {
        Some(1) => "1 byte is missing in".to_owned(),
        Some(n) => format!("{n} bytes are missing in"),
        None => "a part is missing or damaged in".to_owned(),
    }
}

/// A video file that was read through once.
pub struct Video {
    path: PathBuf,
    facts: Facts,
    frames: Vec<FrameInfo>,
    damage: Vec<Damage>,
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
    /// [`VideoError::Open`], [`VideoError::NoVideo`], [`VideoError::NoFrames`] or [`VideoError::Decoder`]. A file that
    /// is damaged but has frames is opened; see [`Self::damage`].
    pub fn open(path: &Path) -> Result<Self, VideoError> {
        let mut input = open_input(path)?;
        let stream = input
            .streams()
            .best(media::Type::Video)
            .ok_or_else(|| VideoError::NoVideo(path.to_owned()))?;
        let index = stream.index();
        let (time_base, rate) = (stream.time_base(), stream.avg_frame_rate());
        let promised = Promised {
            // AVI counts empty chunks too.
            frames: match input.format().name() {
                "avi" => 0,
                _ => u64::try_from(stream.frames()).unwrap_or(0),
            },
            duration_us: input.duration(),
        };
        let parameters = stream.parameters();
        let exif = exif_orientation(&input, path);
        let (orientation, mut notes) = orientation(&stream, exif);

        let (mut stamps, read_error) = read_through(&mut input, index, parameters.id());
        mark_wrong_checksums(&mut stamps);
        let ordered = Ordered::from(&stamps, time_base, rate);
        if ordered.frames.is_empty() {
            return Err(VideoError::NoFrames(path.to_owned()));
        }
        let decoder = decoder::open(parameters.clone(), 1).map_err(|why| {
            let codec = format!("{:?}", parameters.id());
            VideoError::Decoder {
                path: path.to_owned(),
                codec,
                why,
            }
        })?;
        let colour = Colour::stated(
            decoder.format(),
            decoder.color_range(),
            decoder.color_space(),
            decoder.height(),
        );
        notes.extend(ordered.note);
        notes.extend(colour.note());
        Ok(Self {
            path: path.to_owned(),
            facts: facts(&decoder, colour, orientation, exif),
            damage: find_damage(path, &ordered.frames, stamps.len(), &promised, read_error),
            frames: ordered.frames,
            notes,
            track: Track {
                stream: index,
                codec: decoder.id(),
                coded: (decoder.width(), decoder.height()),
                colour,
                orientation,
                number_of_packet: ordered.number_of_packet,
                number_at: ordered.number_at,
                keys: ordered.keys,
            },
            pool: Pool::new(parameters),
        })
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Codec, size and colour.
    #[must_use]
    pub fn facts(&self) -> &Facts {
        &self.facts
    }

    /// All frames in order of presentation; `frames()[i].number == i`.
    #[must_use]
    pub fn frames(&self) -> &[FrameInfo] {
        &self.frames
    }

    /// Numbers of the frames that can be decoded without any other, sorted: all of Motion JPEG, the key frames of
    /// H.264. A [`Reader`] that is asked for none but these decodes no other.
    #[must_use]
    pub fn key_frames(&self) -> &[u64] {
        &self.track.keys
    }

    /// Signs that the file is incomplete or damaged; empty if there are none.
    #[must_use]
    pub fn damage(&self) -> &[Damage] {
        &self.damage
    }

    /// What had to be assumed about the file, for its user.
    #[must_use]
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
            return Err(wrong(DecodeFault::NotWhole));
        }
        let all = Rect::new(0, 0, self.facts.width, self.facts.height);
        if let Some(picture) = self.sought(number) {
            return picture.rgb(all).map_err(wrong);
        }
        let pending = reader.next().ok_or_else(|| wrong(DecodeFault::NoPicture))?;
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

fn facts(
    decoder: &VideoDecoder,
    colour: Colour,
    orientation: Orientation,
    exif: Option<Exif>,
) -> Facts {
    let (width, height) = orientation.displayed(decoder.width(), decoder.height());
    let codec = decoder.codec().map(|codec| codec.name().to_owned());
    let format = decoder
        .format()
        .descriptor()
        .map(|format| format.name().to_owned());
    Facts {
        codec: codec.unwrap_or_else(|| format!("{:?}", decoder.id())),
        width,
        height,
        pixel_format: format.unwrap_or_else(|| "unknown".to_owned()),
        full_range: colour.full_range,
        exif_orientation: exif.map(Exif::to_exif),
    }
}

/// The rotation that the stream or a photograph's Exif asks for, and remarks about it.
pub(super) fn orientation(
    stream: &format::stream::Stream<'_>,
    exif: Option<Exif>,
) -> (Orientation, Vec<String>) {
    if let Some(exif) = exif {
        return (Orientation::from_exif(exif), Vec::new());
    }
    let mut side_data = stream.side_data();
    let matrix = side_data.find(|data| data.kind() == side_data::Type::DisplayMatrix);
    match matrix.map(|matrix| Orientation::from_display_matrix(matrix.data())) {
        None => (Orientation::default(), Vec::new()),
        Some(Some(orientation)) => (orientation, Vec::new()),
        Some(None) => {
            let note = "the file asks for a rotation that is not a multiple of 90 degrees, which is left out";
            (Orientation::default(), vec![note.to_owned()])
        }
    }
}

fn read_through(
    input: &mut Input,
    stream: usize,
    codec: codec::Id,
) -> (Vec<Stamp>, Option<ffmpeg_next::Error>) {
    let mut stamps = Vec::new();
    loop {
        // A packet that is read into again would keep the memory of what it held.
        let mut packet = Packet::empty();
        match packet.read(input) {
            Ok(()) if packet.stream() == stream && packet.size() > 0 => {
                stamps.push(Stamp::of(&packet, codec));
            }
            Ok(()) => {}
            Err(ffmpeg_next::Error::Eof) => return (stamps, None),
            Err(why) => return (stamps, Some(why)),
        }
    }
}

/// The length that the container states; 0 if it states none.
struct Promised {
    frames: u64,
    duration_us: i64,
}

fn find_damage(
    path: &Path,
    frames: &[FrameInfo],
    packets: usize,
    promised: &Promised,
    read_error: Option<ffmpeg_next::Error>,
) -> Vec<Damage> {
    let found = frames.len() as u64;
    let mut damage = Vec::new();
    let cut = File::open(path).and_then(|file| find_truncation(&mut BufReader::new(file)));
    if let Ok(Some(cut)) = cut {
        damage.push(Damage::Truncated(cut));
    }
    if let Some(why) = read_error {
        damage.push(Damage::ReadError { found, why });
    }
    // The container also counts what a trimmed clip does not show.
    let packets = packets as u64;
    if promised.frames > packets {
        damage.push(Damage::FewerFrames {
            promised: promised.frames,
            found: packets,
        });
    }
    let mut damaged = frames.iter().filter(|frame| frame.damaged);
    if let Some(first) = damaged.next() {
        damage.push(Damage::DamagedFrames {
            count: 1 + damaged.count() as u64,
            first: first.number,
        });
    }
    if let [first, .., last] = frames
        && damage.is_empty()
    {
        let step = last.t_us.saturating_sub(first.t_us) / (frames.len() as i64 - 1);
        let promised_us = promised.duration_us;
        let found_us = last.t_us.saturating_add(step);
        // Sound that is longer than the picture, or a slow last frame, is no damage; a tenth of the
        // length is.
        if promised_us
            > found_us
                .saturating_add(promised_us / 10)
                .saturating_add(step.saturating_mul(2))
        {
            damage.push(Damage::Shorter {
                promised_us,
                found_us,
            });
        }
    }
    damage
}
