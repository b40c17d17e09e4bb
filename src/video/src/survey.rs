//! Which pictures a decoder makes of a file, where the packets do not tell.

use std::collections::BTreeMap;
use std::num::NonZero;
use std::path::Path;
use std::thread;

use ffmpeg_next::codec::Id;
use ffmpeg_next::{Packet, frame};

use super::annexb::ByteStream;
use super::decoder::{self, VideoDecoder};
use super::packet_contents::extra_data;
use super::reader::fault_of;
use super::{DecodeFault, VideoError, open_input};

/// Threads that decode.
const MAX_THREADS: usize = 8;

/// The pictures of a file, in the decoder's order.
pub(super) struct Survey {
    /// The time stamp of each.
    pub(super) stamps: Vec<Option<i64>>,
    /// What is wrong with some of them.
    pub(super) faults: BTreeMap<u64, DecodeFault>,
    /// Packets of pictures that the decoder refused.
    pub(super) refused: u64,
    /// The damaged frame on which those up to the next key frame may depend.
    broken_by: Option<u64>,
}

impl Survey {
    /// Decodes a stream of so many packets from its beginning to its end.
    pub(super) fn decode(
        path: &Path,
        (stream, packets): (usize, usize),
        codec: &str,
    ) -> Result<Self, VideoError> {
        let mut input = open_input(path)?;
        let parameters = input
            .stream(stream)
            .ok_or_else(|| VideoError::no_video(path))?
            .parameters();
        let byte_stream = match parameters.id() {
            Id::H264 => ByteStream::from_extra_data(&extra_data(&parameters)),
            _ => None,
        };
        let threads = thread::available_parallelism().map_or(1, NonZero::get);
        let decoder = decoder::open(parameters, threads.min(MAX_THREADS));
        let mut decoder = decoder.map_err(VideoError::decoder(path, codec))?;
        let mut survey = Self {
            stamps: Vec::new(),
            faults: BTreeMap::new(),
            refused: 0,
            broken_by: None,
        };
        // What comes before the first key frame of a stream that was cut is not promised.
        let mut begun = false;
        // FFmpeg also refuses packets without a picture.
        let mut silent = 0;
        let mut errors = 0;
        let mut read = 0;
        loop {
            // A packet that is read into again would keep the memory of what it held.
            let mut packet = Packet::empty();
            match packet.read(&mut input) {
                Ok(()) if packet.stream() != stream || packet.size() == 0 => continue,
                Ok(()) => {}
                Err(_) => break,
            }
            read += 1;
            begun |= packet.is_key();
            let data = packet.data().unwrap_or_default();
            let has_picture = byte_stream.as_ref().is_none_or(|by| by.has_picture(data));
            silent += u64::from(begun && !has_picture);
            let sent = u64::from(decoder.send_packet(&packet).is_err());
            let failed = sent + survey.drain(&mut decoder);
            errors += if begun { failed } else { 0 };
            if errors > silent && survey.broken_by.is_none() && failed > 0 && begun {
                survey.broken_by = Some(survey.stamps.len() as u64);
            }
        }
        if read < packets {
            return Err(VideoError::unreadable(
                path,
                "became shorter while it was read: is it being written, or is its disk gone?",
            ));
        }
        if decoder.send_eof().is_ok() {
            errors += survey.drain(&mut decoder);
        }
        survey.refused = errors.saturating_sub(silent);
        Ok(survey)
    }

    /// The time stamp of each picture, and whether it is damaged.
    pub(super) fn pictures(&self) -> Vec<(Option<i64>, bool)> {
        let numbered = (0..).zip(&self.stamps);
        let pictures = numbered.map(|(number, &stamp)| (stamp, self.faults.contains_key(&number)));
        pictures.collect()
    }

    /// Takes what the decoder has; how many errors came.
    fn drain(&mut self, decoder: &mut VideoDecoder) -> u64 {
        let mut errors = 0;
        loop {
            let mut picture = frame::Video::empty();
            match decoder.receive_frame(&mut picture) {
                Ok(()) => self.take(&picture),
                // As in the reader: with threads, the frames after a damaged packet follow.
                Err(ffmpeg_next::Error::InvalidData) if errors < 64 => errors += 1,
                Err(_) => return errors,
            }
        }
    }

    fn take(&mut self, picture: &frame::Video) {
        let number = self.stamps.len() as u64;
        self.stamps
            .push(picture.timestamp().or_else(|| picture.pts()));
        if let Some(fault) = fault_of(picture, number, true, &mut self.broken_by) {
            self.faults.insert(number, fault);
        }
    }
}
