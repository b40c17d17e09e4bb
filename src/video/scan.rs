//! Reading through a video once without decoding: which frames it has, and whether it is whole.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

use ffmpeg_next::codec::packet::side_data;
use ffmpeg_next::format::context::Input;
use ffmpeg_next::{Packet, Rational, codec, format, media};
use image::RgbImage;

use super::decoder::{self, Pool};
use super::orientation::Orientation;
use super::picture::Colour;
use super::{Cut, Error, FrameFault, Pending, Reader, find_cut, initialise};
use crate::geometry::Rect;

/// What is known of one frame before it is decoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FrameInfo {
    /// Position in the video, 0-based, in order of presentation.
    pub number: u64,
    /// When it is shown, microseconds from the zero of the file's clock.
    pub t_us: i64,
    /// True where the container says that its data are not whole.
    pub damaged: bool,
}

/// What is known of a video as a whole.
#[derive(Debug, Clone, PartialEq, Eq)]
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
}

/// A sign that a video is not whole.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Damage {
    /// The file ends inside an element.
    #[error(
        "the file is cut off: what begins at byte {at} is not whole{missing}",
        at = .0.element_at,
        missing = .0.missing.map(|n| format!(", {n} bytes are missing")).unwrap_or_default()
    )]
    CutOff(Cut),
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
        /// FFmpeg's word.
        why: ffmpeg_next::Error,
    },
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

/// How packets of the file become numbered frames.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) stream: usize,
    pub(super) codec: codec::Id,
    /// Coded width and height.
    pub(super) coded: (u32, u32),
    pub(super) colour: Colour,
    pub(super) orientation: Orientation,
    /// The frame's number of each packet, in the order in which packets stand in the file.
    pub(super) number_of_packet: Vec<u64>,
    /// Time stamps and numbers, sorted; empty where frames have none or share them, and the order
    /// in which the decoder gives frames is the only guide.
    pub(super) number_at: Vec<(i64, u64)>,
}

impl Video {
    /// Opens a file and reads through it once.
    ///
    /// # Errors
    /// [`Error::Open`], [`Error::NoVideo`], [`Error::NoFrames`] or [`Error::Decoder`]. A file that
    /// is damaged but has frames is opened; [`Self::damage`] tells.
    pub fn open(path: &Path) -> Result<Self, Error> {
        initialise();
        let failed = |why| Error::Open {
            path: path.to_owned(),
            why,
        };
        let mut input = format::input(path).map_err(failed)?;
        let stream = input
            .streams()
            .best(media::Type::Video)
            .ok_or_else(|| Error::NoVideo(path.to_owned()))?;
        let index = stream.index();
        let time_base = stream.time_base();
        let promised_frames = u64::try_from(stream.frames()).unwrap_or(0);
        let parameters = stream.parameters();
        let matrix = display_matrix(&stream);
        let promised_us = input.duration();

        let (stamps, read_error) = read_through(&mut input, index);
        if stamps.is_empty() {
            return Err(Error::NoFrames(path.to_owned()));
        }
        let ordered = Ordered::from(&stamps, time_base);

        let id = parameters.id();
        let decoder = decoder::open(parameters.clone(), 1).map_err(|why| Error::Decoder {
            path: path.to_owned(),
            codec: format!("{id:?}"),
            why,
        })?;
        let coded = (decoder.width(), decoder.height());
        let pixel = decoder.format();
        let colour = Colour::stated(pixel, decoder.color_range(), decoder.color_space(), coded.1);
        let (orientation, mut notes) = match matrix {
            None => (Orientation::default(), Vec::new()),
            Some(bytes) => match Orientation::from_display_matrix(&bytes) {
                Some(orientation) => (orientation, Vec::new()),
                None => (
                    Orientation::default(),
                    vec!["the file asks for a rotation that is not a multiple of 90 degrees, which is left out".to_owned()],
                ),
            },
        };
        if colour.matrix_assumed {
            notes.push(format!(
                "the file does not state its colour matrix; {:?} is assumed from its size",
                colour.matrix
            ));
        }
        let (width, height) = orientation.displayed(coded.0, coded.1);
        let damage = find_damage(
            path,
            &ordered.frames,
            promised_frames,
            promised_us,
            read_error,
        );
        Ok(Self {
            path: path.to_owned(),
            facts: Facts {
                codec: decoder
                    .codec()
                    .map_or_else(|| format!("{id:?}"), |codec| codec.name().to_owned()),
                width,
                height,
                pixel_format: pixel
                    .descriptor()
                    .map_or_else(|| "unknown".to_owned(), |d| d.name().to_owned()),
                full_range: colour.full_range,
            },
            frames: ordered.frames,
            damage,
            notes,
            track: Track {
                stream: index,
                codec: id,
                coded,
                colour,
                orientation,
                number_of_packet: ordered.number_of_packet,
                number_at: ordered.number_at,
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

    /// Signs that the file is not whole; empty where there are none.
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
    /// [`Error::NoSuchFrame`], or what opening the file again answers.
    pub fn read(&self, wanted: &[u64], threads: usize) -> Result<Reader<'_>, Error> {
        let last = self.frames.len() as u64 - 1;
        if let Some(&number) = wanted.iter().find(|&&number| number > last) {
            return Err(Error::NoSuchFrame {
                path: self.path.clone(),
                number,
                last,
            });
        }
        Reader::open(self, wanted, threads)
    }

    /// Decodes one frame to RGB, as displayed.
    ///
    /// # Errors
    /// [`Error::NoSuchFrame`], [`Error::Frame`], or what opening the file again answers.
    pub fn frame(&self, number: u64) -> Result<RgbImage, Error> {
        let wrong = |fault| Error::Frame {
            path: self.path.clone(),
            number,
            fault,
        };
        let mut reader = self.read(&[number], 1)?;
        let pending = reader.next().ok_or_else(|| wrong(FrameFault::NoPicture))?;
        let all = Rect::new(0, 0, self.facts.width, self.facts.height);
        self.picture(pending)
            .and_then(|picture| picture.rgb(all))
            .map_err(wrong)
    }

    /// Decodes what a [`Reader`] of this video handed out. May be called from many threads at
    /// once.
    ///
    /// # Errors
    /// [`FrameFault`] where the frame yields no picture.
    pub fn picture(&self, pending: Pending) -> Result<super::Picture, FrameFault> {
        reader_picture(self, pending)
    }
}

fn reader_picture(video: &Video, pending: Pending) -> Result<super::Picture, FrameFault> {
    pending.decode(&video.track, &video.pool)
}

fn display_matrix(stream: &format::stream::Stream<'_>) -> Option<Vec<u8>> {
    let found = stream
        .side_data()
        .find(|data| data.kind() == side_data::Type::DisplayMatrix)?;
    Some(found.data().to_vec())
}

/// What a packet says of its frame.
#[derive(Debug, Clone, Copy)]
struct Stamp {
    /// Time stamp in units of the stream's time base.
    pts: Option<i64>,
    damaged: bool,
}

fn read_through(input: &mut Input, stream: usize) -> (Vec<Stamp>, Option<ffmpeg_next::Error>) {
    let mut stamps = Vec::new();
    loop {
        // A packet that is read into again would keep the memory of what it held.
        let mut packet = Packet::empty();
        match packet.read(input) {
            Ok(()) if packet.stream() == stream && packet.size() > 0 => {
                let pts = packet.pts().or_else(|| packet.dts());
                stamps.push(Stamp {
                    pts,
                    damaged: packet.is_corrupt(),
                });
            }
            Ok(()) => {}
            Err(ffmpeg_next::Error::Eof) => return (stamps, None),
            Err(why) => return (stamps, Some(why)),
        }
    }
}

/// Packets brought into the order of presentation.
struct Ordered {
    frames: Vec<FrameInfo>,
    number_of_packet: Vec<u64>,
    number_at: Vec<(i64, u64)>,
}

impl Ordered {
    fn from(stamps: &[Stamp], time_base: Rational) -> Self {
        let stamped = stamps.iter().all(|stamp| stamp.pts.is_some());
        let mut order: Vec<usize> = (0..stamps.len()).collect();
        if stamped {
            order.sort_by_key(|&packet| stamps[packet].pts);
        }
        let mut number_of_packet = vec![0; stamps.len()];
        let mut frames = Vec::with_capacity(stamps.len());
        let mut number_at = Vec::new();
        for (number, &packet) in (0_u64..).zip(&order) {
            number_of_packet[packet] = number;
            let pts = stamps[packet].pts;
            frames.push(FrameInfo {
                number,
                t_us: microseconds(pts.unwrap_or(0), time_base),
                damaged: stamps[packet].damaged,
            });
            number_at.extend(pts.map(|pts| (pts, number)));
        }
        let unique = number_at.windows(2).all(|pair| pair[0].0 < pair[1].0);
        if !stamped || !unique {
            number_at.clear();
        }
        Self {
            frames,
            number_of_packet,
            number_at,
        }
    }
}

fn microseconds(pts: i64, time_base: Rational) -> i64 {
    let numerator = i128::from(pts) * i128::from(time_base.numerator()) * 1_000_000;
    let denominator = i128::from(time_base.denominator()).max(1);
    let rounded = (2 * numerator + denominator).div_euclid(2 * denominator);
    i64::try_from(rounded).unwrap_or(i64::MAX)
}

fn find_damage(
    path: &Path,
    frames: &[FrameInfo],
    promised_frames: u64,
    promised_us: i64,
    read_error: Option<ffmpeg_next::Error>,
) -> Vec<Damage> {
    let found = frames.len() as u64;
    let mut damage = Vec::new();
    let cut = File::open(path).and_then(|file| find_cut(&mut BufReader::new(file)));
    if let Ok(Some(cut)) = cut {
        damage.push(Damage::CutOff(cut));
    }
    if let Some(why) = read_error {
        damage.push(Damage::ReadError { found, why });
    }
    if promised_frames > found {
        damage.push(Damage::FewerFrames {
            promised: promised_frames,
            found,
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
        let step = (last.t_us - first.t_us) / (frames.len() as i64 - 1);
        let found_us = last.t_us.saturating_add(step);
        // Sound that outlasts the picture, or a slow last frame, is no damage: a tenth is.
        if promised_us
            > found_us
                .saturating_add(promised_us / 10)
                .saturating_add(2 * step)
        {
            damage.push(Damage::Shorter {
                promised_us,
                found_us,
            });
        }
    }
    damage
}
