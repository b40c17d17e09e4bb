//! How packets of a file become numbered frames, and decoded frames pictures.

use std::collections::BTreeMap;

use ffmpeg_next::{codec, frame};

use super::DecodeFault;
use super::colour::Colour;
use super::display::Display;
use super::picture::Picture;

/// How packets of the file become numbered frames.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) stream: usize,
    pub(super) codec: codec::Id,
    /// Coded width and height.
    pub(super) coded: (u32, u32),
    pub(super) colour: Colour,
    pub(super) display: Display,
    pub(super) numbering: Numbering,
    /// The frame number of each packet; empty where the decoder numbers.
    pub(super) number_of_packet: Vec<Option<u64>>,
    /// The time stamp of each frame, in units of the stream's time base.
    pub(super) stamps: Vec<Option<i64>>,
    /// Numbers of the frames with which decoding can begin, sorted.
    pub(super) keys: Vec<u64>,
}

/// What gives the frames their numbers.
#[derive(Debug, Clone)]
pub(super) enum Numbering {
    /// Each packet is a picture.
    Packets,
    /// Each packet is a picture, with a time stamp of its own, by which decoded frames are known.
    Stamps,
    /// The pictures that a decoder returned, in its order; some are damaged.
    Decoder(BTreeMap<u64, DecodeFault>),
}

impl Track {
    /// A decoded frame as a picture of this track.
    pub(super) fn picture(&self, number: u64, frame: frame::Video) -> Result<Picture, DecodeFault> {
        let (width, height) = self.coded;
        let (w, h) = (frame.width(), frame.height());
        if (w, h) != self.coded {
            return Err(DecodeFault::Unusable(format!(
                "it is {w} x {h} pixels in a video of {width} x {height}"
            )));
        }
        let (colour, display) = (self.colour.clone(), self.display);
        Ok(Picture::new(number, frame, colour, display))
    }

    /// Whether each packet that is shown is a frame.
    pub(super) fn is_by_packets(&self) -> bool {
        !matches!(self.numbering, Numbering::Decoder(_))
    }

    /// Whether a time stamp belongs to one frame and no other.
    pub(super) fn stamps_are_unique(&self) -> bool {
        matches!(self.numbering, Numbering::Stamps)
    }

    /// The number of the decoded frame with this time stamp: the next one from `least` on that has it. `None` for a
    /// picture that the file does not promise.
    pub(super) fn number_of(&self, stamp: Option<i64>, least: u64) -> Option<u64> {
        let from = usize::try_from(least).unwrap_or(usize::MAX);
        let later = self.stamps.get(from..).unwrap_or_default();
        let ahead = stamp.and_then(|_| later.iter().position(|&at| at == stamp));
        match ahead {
            Some(ahead) => Some(least + ahead as u64),
            None if self.stamps_are_unique() && stamp.is_some() => None,
            None => (from < self.stamps.len()).then_some(least),
        }
    }

    pub(super) fn is_key(&self, number: u64) -> bool {
        self.keys.binary_search(&number).is_ok()
    }
}
