//! How packets of a file become numbered frames, and decoded frames pictures.

use ffmpeg_next::{codec, frame};

use super::DecodeFault;
use super::orientation::Orientation;
use super::picture::{Colour, Picture};

/// How packets of the file become numbered frames.
#[derive(Debug, Clone)]
pub(super) struct Track {
    pub(super) stream: usize,
    pub(super) codec: codec::Id,
    /// Coded width and height.
    pub(super) coded: (u32, u32),
    pub(super) colour: Colour,
    pub(super) orientation: Orientation,
    pub(super) number_of_packet: Vec<Option<u64>>,
    pub(super) number_at: Vec<(i64, u64)>,
    /// Numbers of the frames that need no other, sorted.
    pub(super) keys: Vec<u64>,
}

impl Track {
    /// A decoded frame as a picture of this track.
    pub(super) fn picture(&self, number: u64, frame: frame::Video) -> Result<Picture, DecodeFault> {
        let (wanted_w, wanted_h) = self.coded;
        let (found_w, found_h) = (frame.width(), frame.height());
        if (found_w, found_h) != self.coded {
            return Err(DecodeFault::Size {
                found_w,
                found_h,
                wanted_w,
                wanted_h,
            });
        }
        Ok(Picture::new(number, frame, self.colour, self.orientation))
    }

    /// The number of the frame with this time stamp, in units of the stream's time base.
    pub(super) fn number_at(&self, pts: i64) -> Option<u64> {
        let at = self
            .number_at
            .binary_search_by_key(&pts, |&(pts, _)| pts)
            .ok()?;
        Some(self.number_at[at].1)
    }
}
