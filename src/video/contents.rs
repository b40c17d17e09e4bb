//! What a packet of a file holds, by the headers of its codec: a picture that is shown, one that others need and nobody
//! sees, or something that only a decoder can tell.

use std::ptr;

use ffmpeg_next::codec::{self, Id, Parameters};
use ffmpeg_next::{Packet, ffi};

use super::annexb::ByteStream;
use super::nal;

/// What a packet holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Contents {
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
    Vp8,
    Vp9,
    /// Packets can be fields, hold two pictures, or say that the last one is repeated.
    Any,
}

impl Coding {
    fn from_codec(codec: Id) -> Self {
        match codec {
            Id::FFV1 | Id::MJPEG | Id::RAWVIDEO | Id::PNG | Id::BMP | Id::TIFF => Self::OneEach,
            Id::AV1 | Id::HEVC | Id::MPEG1VIDEO | Id::MPEG2VIDEO => Self::OneEachInOrder,
            Id::H264 => Self::H264,
            Id::VP8 => Self::Vp8,
            Id::VP9 => Self::Vp9,
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
    fn contents(&mut self, packet: &Packet) -> Contents {
        if self.parser.is_field(packet) {
            return Contents::Unclear;
        }
        // Between pictures, a byte stream can have packets without any.
        let data = packet.data().unwrap_or_default();
        match self.byte_stream.has_picture(data) {
            true => Contents::Picture,
            false => Contents::Hidden,
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
    pub(super) fn inspect(&mut self, packet: &Packet) -> (Contents, bool) {
        let data = packet.data().unwrap_or_default();
        let shown = |shown| match shown {
            Some(true) => Contents::Picture,
            Some(false) => Contents::Hidden,
            None => Contents::Unclear,
        };
        let contents = match self.coding {
            Coding::OneEach | Coding::OneEachInOrder => Contents::Picture,
            Coding::Vp8 => shown(vp8_is_shown(data)),
            Coding::Vp9 => shown(vp9_is_shown(data)),
            Coding::H264 => match &mut self.h264 {
                Some(h264) => h264.contents(packet),
                None => Contents::Unclear,
            },
            Coding::Any => Contents::Unclear,
        };
        // The container's flag also means a recovery point, after which some pictures are incomplete.
        let key = packet.is_key()
            && self
                .h264
                .as_ref()
                .is_none_or(|h264| nal::is_key(&h264.byte_stream.convert(data, false)));
        (contents, key)
    }
}

/// RFC 6386, section 9.1: the bit `show_frame` of the frame's tag.
fn vp8_is_shown(data: &[u8]) -> Option<bool> {
    data.first().map(|tag| tag & 0x10 != 0)
}

/// Whether any picture of the packet is shown (VP9 bitstream specification, sections 6.2 and annex B: a superframe ends
/// with an index of its frames' sizes between two equal markers).
fn vp9_is_shown(data: &[u8]) -> Option<bool> {
    let marker = *data.last()?;
    if marker & 0xe0 != 0xc0 {
        return vp9_frame_is_shown(data);
    }
    let (frames, bytes) = (
        usize::from(marker & 7) + 1,
        usize::from(marker >> 3 & 3) + 1,
    );
    let index = data.len().checked_sub(2 + frames * bytes);
    let Some(index) = index.filter(|&index| data[index] == marker) else {
        return vp9_frame_is_shown(data);
    };
    let mut rest = &data[..index];
    let mut any = false;
    for size in data[index + 1..data.len() - 1].chunks_exact(bytes) {
        let size = size
            .iter()
            .rev()
            .fold(0, |sum, &byte| sum << 8 | usize::from(byte));
        let (frame, after) = rest.split_at_checked(size)?;
        rest = after;
        any |= !frame.is_empty() && vp9_frame_is_shown(frame)?;
    }
    Some(any)
}

/// The first bits of a frame's header: the marker 2 (2 bits), the profile (2, low bit first; 1 more after profile 3),
/// `show_existing_frame`, `frame_type` and `show_frame`.
fn vp9_frame_is_shown(frame: &[u8]) -> Option<bool> {
    let first = *frame.first()?;
    let header = u16::from(first) << 8 | u16::from(*frame.get(1).unwrap_or(&0));
    let bit = |at: u16| header >> (15 - at) & 1 == 1;
    if first >> 6 != 2 {
        return None;
    }
    let after_profile = if bit(2) && bit(3) { 5 } else { 4 };
    Some(bit(after_profile) || bit(after_profile + 2))
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
    use proptest::prelude::*;

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

    #[test]
    fn a_frame_of_vp8_says_whether_it_is_shown() {
        assert_eq!(vp8_is_shown(&[0x10, 2, 0]), Some(true));
        assert_eq!(vp8_is_shown(&[0x01, 2, 0]), Some(false));
        assert_eq!(vp8_is_shown(&[]), None);
    }

    #[test]
    fn a_superframe_of_vp9_is_shown_if_one_of_its_frames_is() {
        let (hidden, shown, again) = ([0x84, 0], [0x86, 0], [0x88, 0]);
        assert_eq!(vp9_is_shown(&hidden), Some(false));
        assert_eq!(vp9_is_shown(&shown), Some(true));
        assert_eq!(vp9_is_shown(&again), Some(true));
        let superframe = |frames: [&[u8]; 2]| {
            let sizes = frames.map(|frame| frame.len() as u8);
            [frames[0], frames[1], &[0xc1], &sizes, &[0xc1]].concat()
        };
        assert_eq!(vp9_is_shown(&superframe([&hidden, &shown])), Some(true));
        assert_eq!(vp9_is_shown(&superframe([&hidden, &hidden])), Some(false));
        assert_eq!(vp9_is_shown(&[0xc1, 200, 200, 0xc1]), None);
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..40)) {
            vp8_is_shown(&bytes);
            vp9_is_shown(&bytes);
        }
    }
}
