//! Reading a video's frames as they are coded, without decoding.

use ffmpeg_next::Packet;
use ffmpeg_next::codec::Id;
use ffmpeg_next::format::context::Input;

use super::annexb::ByteStream;
use super::packet_contents::extra_data;
use super::scan::Video;
use super::{VideoError, open_input};

/// One frame as it is coded in the file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CodedFrame {
    /// Position in the video, 0-based, in order of presentation.
    pub number: u64,
    /// The data: a JPEG, a raw picture, or H.264 with start codes and parameter sets.
    pub data: Vec<u8>,
    /// True if it can be decoded without any other frame.
    pub key: bool,
    /// True if, according to the container, its data are incomplete.
    pub damaged: bool,
}

/// Returns the coded frames of a [`Video`] in the order of the file.
pub struct Packets {
    input: Input,
    stream: usize,
    byte_stream: ByteStream,
    number_of_packet: std::vec::IntoIter<Option<u64>>,
}

impl std::fmt::Debug for Packets {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Packets({} left)", self.number_of_packet.len())
    }
}

impl Video {
    /// Opens the file again to read its coded frames.
    ///
    /// # Errors
    /// [`VideoError::Unreadable`], also where the stream is gone or its parameters cannot be read.
    pub fn packets(&self) -> Result<Packets, VideoError> {
        let input = open_input(self.path())?;
        let stream = input.stream(self.track.stream);
        let byte_stream = stream.and_then(|stream| match self.track.codec {
            Id::H264 => ByteStream::from_extra_data(&extra_data(&stream.parameters())),
            _ => Some(ByteStream::AsIs),
        });
        let byte_stream = byte_stream.ok_or_else(|| VideoError::no_video(self.path()))?;
        Ok(Packets {
            input,
            stream: self.track.stream,
            byte_stream,
            number_of_packet: self.track.number_of_packet.clone().into_iter(),
        })
    }

    /// True if each packet of the file is a frame, in order of presentation, as a camera delivers them.
    pub fn is_in_order(&self) -> bool {
        self.track.is_by_packets() && self.track.number_of_packet.iter().flatten().is_sorted()
    }

    /// Width and height as coded, before any rotation, pixels.
    pub fn coded_size(&self) -> (u32, u32) {
        self.track.coded
    }
}

impl Iterator for Packets {
    type Item = CodedFrame;

    /// The next coded frame that is shown; `None` at the end of what can be read.
    fn next(&mut self) -> Option<CodedFrame> {
        loop {
            // A packet that is read into again would keep the memory of what it held.
            let mut packet = Packet::empty();
            packet.read(&mut self.input).ok()?;
            if packet.stream() != self.stream || packet.size() == 0 {
                continue;
            }
            let Some(number) = self.number_of_packet.next()? else {
                continue;
            };
            let data = packet.data().unwrap_or_default();
            return Some(CodedFrame {
                number,
                data: self.byte_stream.convert(data, packet.is_key()),
                key: packet.is_key(),
                damaged: packet.is_corrupt(),
            });
        }
    }
}
