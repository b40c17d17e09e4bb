//! Decoding a camera's frames as they arrive, for previews and metering; nothing is kept.

use ffmpeg_next::codec::{self, decoder};
use ffmpeg_next::{Packet, frame};

use super::colour::ColourProperties;
use super::decoder::VideoDecoder;
use super::display::Display;
use super::lossless;
use super::picture::Picture;
use super::{DecodeFault, PixelFormat, initialise};

/// Decodes one frame after the other, in the order in which the camera delivers them.
pub struct LiveDecoder {
    format: PixelFormat,
    width: u32,
    height: u32,
    decoder: Option<VideoDecoder>,
    number: u64,
}

impl std::fmt::Debug for LiveDecoder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "LiveDecoder({:?}, {} x {})",
            self.format, self.width, self.height
        )
    }
}

impl LiveDecoder {
    /// For frames of this format and size.
    ///
    /// # Errors
    /// [`DecodeFault::Damaged`] if this FFmpeg lacks the codec.
    pub fn new(format: PixelFormat, width: u32, height: u32) -> Result<Self, DecodeFault> {
        initialise();
        let decoder = match format {
            PixelFormat::Mjpeg => Some(open(codec::Id::MJPEG)?),
            PixelFormat::H264 => Some(open(codec::Id::H264)?),
            _ => None,
        };
        Ok(Self {
            format,
            width,
            height,
            decoder,
            number: 0,
        })
    }

    /// Decodes the next frame. `None` before the first picture: H.264 begins with a key frame.
    ///
    /// # Errors
    /// [`DecodeFault`] if the data are damaged; the next frame may be fine.
    pub fn decode(&mut self, data: &[u8]) -> Result<Option<Picture>, DecodeFault> {
        let frame = match &mut self.decoder {
            Some(decoder) => match compressed(decoder, data)? {
                Some(frame) => frame,
                None => return Ok(None),
            },
            None => lossless::frame(self.format, data, self.width, self.height)
                .ok_or_else(DecodeFault::not_whole)?,
        };
        let colour = ColourProperties::by_picture(&frame)
            .colour()
            .map_err(|fault| {
                DecodeFault::Unusable(format!("{fault} cannot be converted to sRGB"))
            })?;
        self.number += 1;
        let display = Display::default();
        Ok(Some(Picture::new(self.number - 1, frame, colour, display)))
    }
}

fn open(id: codec::Id) -> Result<VideoDecoder, DecodeFault> {
    let found = decoder::find(id).ok_or(ffmpeg_next::Error::DecoderNotFound);
    let context = codec::Context::new_with_codec(found.map_err(DecodeFault::Damaged)?);
    let mut decoder = context.decoder();
    // Each frame is returned without waiting for those that follow.
    decoder.set_flags(codec::Flags::LOW_DELAY);
    decoder.video().map_err(DecodeFault::Damaged)
}

fn compressed(
    decoder: &mut VideoDecoder,
    data: &[u8],
) -> Result<Option<frame::Video>, DecodeFault> {
    decoder
        .send_packet(&Packet::copy(data))
        .map_err(DecodeFault::Damaged)?;
    let mut newest = None;
    loop {
        let mut picture = frame::Video::empty();
        match decoder.receive_frame(&mut picture) {
            Ok(()) if picture.is_corrupt() || picture.has_decode_errors() => {
                return Err(DecodeFault::concealed());
            }
            Ok(()) => newest = Some(picture),
            Err(_) => return Ok(newest),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use relit_data::geometry::Rect;

    #[test]
    fn a_raw_picture_is_shown_as_the_camera_sent_it() {
        let mut live = LiveDecoder::new(PixelFormat::Rgb24, 2, 2).unwrap();
        let bytes = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
        let picture = live.decode(&bytes).unwrap().unwrap();
        let rgb = picture.rgb(Rect::new(0, 0, 2, 2)).unwrap();
        assert_eq!(rgb.as_raw().as_slice(), &bytes);
    }

    #[test]
    fn data_that_are_no_picture_are_a_fault_and_the_next_one_is_shown() {
        let mut live = LiveDecoder::new(PixelFormat::Grey, 2, 2).unwrap();
        assert!(live.decode(&[1, 2]).is_err());
        assert!(live.decode(&[1, 2, 3, 4]).unwrap().is_some());
        let mut live = LiveDecoder::new(PixelFormat::Mjpeg, 2, 2).unwrap();
        assert!(live.decode(b"no jpeg").is_err());
    }
}
