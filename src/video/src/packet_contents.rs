//! What a packet of a file holds, by the headers of its codec: a picture that is shown, one that others need and nobody
//! sees, or something that only a decoder can tell.

use std::ptr;

use ffmpeg_next::codec::{self, Id, Parameters};
use ffmpeg_next::{Packet, ffi};

use super::annexb::ByteStream;
use super::nal;

/// What a packet holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum PacketContents {
    /// One picture.
    Picture,
    /// A picture that is never shown.
    Hidden,
    /// No more is known before it is decoded: a field, several pictures, or none.
    Unclear,
}

/// How the pictures of a codec follow from its packets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Coding {
    /// Each packet is a picture, without exception.
    OneEach,
    /// Each packet is a picture, if the stream begins where decoding can begin and has time stamps.
    OneEachInOrder,
    H264,
    /// Packets can be fields, hold two pictures or hidden ones, or say that the last one is repeated.
    Any,
}

impl Coding {
    fn from_codec(codec: Id) -> Self {
        match codec {
            Id::FFV1 | Id::MJPEG | Id::RAWVIDEO | Id::PNG | Id::BMP | Id::TIFF => Self::OneEach,
            Id::AV1 | Id::HEVC | Id::MPEG1VIDEO | Id::MPEG2VIDEO => Self::OneEachInOrder,
            Id::H264 => Self::H264,
            _ if is_intra_only(codec) => Self::OneEach,
            _ => Self::Any,
        }
    }
}

/// True if no picture of the codec needs another.
#[allow(unsafe_code)]
fn is_intra_only(codec: Id) -> bool {
    // SAFETY: FFmpeg returns null or a pointer to a constant.
    let descriptor = unsafe { ffi::avcodec_descriptor_get(codec.into()).as_ref() };
    descriptor.is_some_and(|descriptor| descriptor.props & ffi::AV_CODEC_PROP_INTRA_ONLY != 0)
}

/// Looks into the packets of a stream, one after the other.
pub(super) struct Inspector {
    coding: Coding,
    h264: Option<H264>,
}

struct H264 {
    parser: Parser,
    byte_stream: ByteStream,
}

impl H264 {
    fn contents(&mut self, packet: &Packet) -> PacketContents {
        if self.parser.is_field(packet) {
            return PacketContents::Unclear;
        }
        // Between pictures, a byte stream can have packets without any.
        let data = packet.data().unwrap_or_default();
        if self.byte_stream.has_picture(data) {
            PacketContents::Picture
        } else {
            PacketContents::Hidden
        }
    }
}

impl Inspector {
    pub(super) fn new(parameters: &Parameters) -> Self {
        let coding = Coding::from_codec(parameters.id());
        let h264 = || {
            Some(H264 {
                parser: Parser::new(parameters)?,
                byte_stream: ByteStream::from_extra_data(&extra_data(parameters))?,
            })
        };
        Self {
            coding,
            h264: (coding == Coding::H264).then(h264).flatten(),
        }
    }

    /// True if every packet is a picture, whatever stands in it.
    pub(super) fn packets_are_pictures(&self) -> bool {
        self.coding == Coding::OneEach
    }

    /// The contents of the next packet, and whether decoding can begin with it.
    pub(super) fn inspect(&mut self, packet: &Packet) -> (PacketContents, bool) {
        let contents = match self.coding {
            Coding::OneEach | Coding::OneEachInOrder => PacketContents::Picture,
            Coding::H264 => match &mut self.h264 {
                Some(h264) => h264.contents(packet),
                None => PacketContents::Unclear,
            },
            Coding::Any => PacketContents::Unclear,
        };
        // The container's flag also means a recovery point, after which some pictures are incomplete.
        let key = packet.is_key()
            && self.h264.as_ref().is_none_or(|h264| {
                let data = packet.data().unwrap_or_default();
                nal::is_key(&h264.byte_stream.convert(data, false))
            });
        (contents, key)
    }
}

/// FFmpeg's parser of a codec, which reads no more than headers.
struct Parser {
    parser: ptr::NonNull<ffi::AVCodecParserContext>,
    context: codec::Context,
}

impl Drop for Parser {
    #[allow(unsafe_code)]
    fn drop(&mut self) {
        // SAFETY: the pointer is that of `av_parser_init`, and is not used after.
        unsafe { ffi::av_parser_close(self.parser.as_ptr()) }
    }
}

impl Parser {
    #[allow(unsafe_code)]
    fn new(parameters: &Parameters) -> Option<Self> {
        let context = codec::Context::from_parameters(parameters.clone()).ok()?;
        let id: ffi::AVCodecID = parameters.id().into();
        // SAFETY: FFmpeg returns null or a pointer that is valid until it is closed; `flags` is a plain number in it.
        let parser = unsafe {
            let mut parser = ptr::NonNull::new(ffi::av_parser_init(id as _))?;
            parser.as_mut().flags |= ffi::PARSER_FLAG_COMPLETE_FRAMES;
            parser
        };
        Some(Self { parser, context })
    }

    /// Whether the packet's picture is a field.
    #[allow(unsafe_code)]
    fn is_field(&mut self, packet: &Packet) -> bool {
        let Some(data) = packet.data() else {
            return false;
        };
        let Ok(size) = i32::try_from(data.len()) else {
            return false;
        };
        let (mut out, mut out_size) = (ptr::null_mut(), 0);
        let none = ffi::AV_NOPTS_VALUE;
        // SAFETY: parser and context live as long as `self`; the data are a packet's, which FFmpeg pads for its parsers,
        // and what the parser returns points into them and is not used.
        let structure = unsafe {
            let (context, data) = (self.context.as_mut_ptr(), data.as_ptr());
            let parser = self.parser.as_ptr();
            ffi::av_parser_parse2(
                parser,
                context,
                &mut out,
                &mut out_size,
                data,
                size,
                none,
                none,
                0,
            );
            (*parser).picture_structure
        };
        use ffi::AVPictureStructure::{
            AV_PICTURE_STRUCTURE_BOTTOM_FIELD as BOTTOM, AV_PICTURE_STRUCTURE_TOP_FIELD as TOP,
        };
        structure == TOP || structure == BOTTOM
    }
}

/// The container's data for the decoder, which `ffmpeg-next` does not expose.
#[allow(unsafe_code)]
pub(super) fn extra_data(parameters: &Parameters) -> Vec<u8> {
    // SAFETY: the pointer is that of live parameters; FFmpeg keeps `extradata` and its size
    // together, and the bytes are copied while both live.
    unsafe {
        let parameters = &*parameters.as_ptr();
        match usize::try_from(parameters.extradata_size) {
            Ok(size) if !parameters.extradata.is_null() => {
                std::slice::from_raw_parts(parameters.extradata, size).to_vec()
            }
            _ => Vec::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codecs_without_other_pictures_are_known() {
        for codec in [
            Id::MJPEG,
            Id::PRORES,
            Id::DNXHD,
            Id::HUFFYUV,
            Id::FFV1,
            Id::PNG,
        ] {
            assert_eq!(Coding::from_codec(codec), Coding::OneEach, "{codec:?}");
        }
        for codec in [Id::MPEG4, Id::THEORA, Id::GIF, Id::VC1] {
            assert_eq!(Coding::from_codec(codec), Coding::Any, "{codec:?}");
        }
    }
}
