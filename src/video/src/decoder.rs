//! Opening FFmpeg's decoders.

use std::sync::{Mutex, PoisonError};

use ffmpeg_next::codec::decoder::Check;
use ffmpeg_next::codec::threading;
use ffmpeg_next::codec::{self, Parameters, decoder};
use ffmpeg_next::{Packet, frame};

use super::DecodeFault;

pub(super) use ffmpeg_next::codec::decoder::Video as VideoDecoder;

/// True if every packet is a picture that needs no other.
pub(super) fn frames_stand_alone(codec: codec::Id) -> bool {
    matches!(codec, codec::Id::MJPEG | codec::Id::RAWVIDEO)
}

/// Opens a decoder with this many threads (1: none).
pub(super) fn open(
    parameters: Parameters,
    threads: usize,
) -> Result<decoder::Video, ffmpeg_next::Error> {
    let mut context = codec::Context::from_parameters(parameters)?;
    let codec = context.id();
    if threads > 1 {
        context.set_threading(threading::Config {
            kind: threading::Type::Frame,
            count: threads,
            ..Default::default()
        });
    }
    let mut decoder = context.decoder();
    if frames_stand_alone(codec) {
        // Half a JPEG is then an error instead of a picture with a grey lower part.
        decoder.check(Check::EXPLODE | Check::CRC);
    } else {
        decoder.check(Check::CRC);
    }
    decoder.video()
}

/// Decoders for frames that are coded on their own: each thread takes one and returns it.
pub(super) struct Pool {
    parameters: Mutex<Parameters>,
    idle: Mutex<Vec<decoder::Video>>,
}

impl Pool {
    pub(super) fn new(parameters: Parameters) -> Self {
        Self {
            parameters: Mutex::new(parameters),
            idle: Mutex::new(Vec::new()),
        }
    }

    /// Decodes one packet, which is a picture on its own.
    pub(super) fn decode(&self, packet: &Packet) -> Result<frame::Video, DecodeFault> {
        let idle = self
            .idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .pop();
        let mut decoder = match idle {
            Some(decoder) => decoder,
            None => self.open().map_err(DecodeFault::Damaged)?,
        };
        let mut picture = frame::Video::empty();
        decoder.send_packet(packet).map_err(DecodeFault::Damaged)?;
        // A decoder that failed is not reused: it may keep state from the damaged packet.
        decoder
            .receive_frame(&mut picture)
            .map_err(DecodeFault::Damaged)?;
        self.idle
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push(decoder);
        if picture.is_corrupt() || picture.has_decode_errors() {
            return Err(DecodeFault::concealed());
        }
        Ok(picture)
    }

    fn open(&self) -> Result<decoder::Video, ffmpeg_next::Error> {
        let parameters = self
            .parameters
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        open(parameters, 1)
    }
}
