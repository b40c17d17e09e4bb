//! Coding a camera's uncompressed pictures as FFV1, without loss.
//!
//! FFV1 stores planes. Packed and interleaved formats are split into planes byte by byte; no value is
//! converted, so that the decoded planes hold exactly the camera's bytes.

use ffmpeg_next::codec::{self, encoder, threading};
use ffmpeg_next::format::Pixel;
use ffmpeg_next::{Dictionary, Rational, color, frame};

use super::PixelFormat;

/// Threads of an encoder: as many as it has slices.
const SLICES: usize = 4;

/// The bytes of a picture that FFV1 can store; `None` if the format is compressed, or if this size
/// is odd where the format shares colour between two pixels.
pub(super) fn picture_bytes(format: PixelFormat, width: u32, height: u32) -> Option<usize> {
    let (even_width, even_height) = (width.is_multiple_of(2), height.is_multiple_of(2));
    let possible = match format {
        PixelFormat::Yuyv => even_width,
        PixelFormat::Nv12 => even_width && even_height,
        _ => true,
    };
    format
        .frame_bytes(width, height)
        .filter(|&bytes| possible && bytes > 0)
}

/// FFV1's planes for a format.
fn planes(format: PixelFormat) -> Pixel {
    match format {
        PixelFormat::Yuyv => Pixel::YUV422P,
        PixelFormat::Nv12 => Pixel::YUV420P,
        // Blue, green, red and an unused byte: FFV1 codes it as three planes.
        PixelFormat::Rgb24 => Pixel::BGRZ,
        _ => Pixel::GRAY8,
    }
}

/// An FFV1 encoder whose frames are coded on their own, with checksums and without delay.
pub(super) fn encoder(
    format: PixelFormat,
    width: u32,
    height: u32,
) -> Result<encoder::video::Encoder, ffmpeg_next::Error> {
    let codec = encoder::find(codec::Id::FFV1).ok_or(ffmpeg_next::Error::EncoderNotFound)?;
    let mut context = codec::Context::new_with_codec(codec);
    // Threads that share a frame add no delay; threads with a frame each would.
    context.set_threading(threading::Config {
        kind: threading::Type::Slice,
        count: SLICES,
        ..Default::default()
    });
    let mut video = context.encoder().video()?;
    video.set_width(width);
    video.set_height(height);
    video.set_format(planes(format));
    video.set_time_base(Rational::new(1, 1_000_000));
    video.set_gop(1);
    match format {
        // Video4Linux's default if a driver states nothing: limited range, BT.601.
        PixelFormat::Yuyv | PixelFormat::Nv12 => {
            video.set_color_range(color::Range::MPEG);
            video.set_colorspace(color::Space::SMPTE170M);
        }
        _ => video.set_color_range(color::Range::JPEG),
    }
    let mut options = Dictionary::new();
    options.set("level", "3");
    options.set("slicecrc", "1");
    options.set("slices", &SLICES.to_string());
    // The Golomb-Rice coder: some per cent larger than the range coder, and twice as fast.
    options.set("coder", "0");
    video.open_as_with(codec, options)
}

/// The picture as a frame for the encoder; `None` if `bytes` is not exactly one picture.
pub(super) fn frame(
    format: PixelFormat,
    bytes: &[u8],
    width: u32,
    height: u32,
) -> Option<frame::Video> {
    if bytes.len() != picture_bytes(format, width, height)? {
        return None;
    }
    let mut frame = frame::Video::new(planes(format), width, height);
    let row = width as usize;
    match format {
        PixelFormat::Rgb24 => {
            for (to, from) in rows(&mut frame, 0).zip(bytes.chunks_exact(3 * row)) {
                for (to, from) in to.chunks_exact_mut(4).zip(from.chunks_exact(3)) {
                    to.copy_from_slice(&[from[2], from[1], from[0], 0]);
                }
            }
        }
        PixelFormat::Yuyv => {
            spread(&mut frame, 0, bytes, 2 * row, 0, 2);
            spread(&mut frame, 1, bytes, 2 * row, 1, 4);
            spread(&mut frame, 2, bytes, 2 * row, 3, 4);
        }
        PixelFormat::Nv12 => {
            let (luma, colour) = bytes.split_at(row * height as usize);
            spread(&mut frame, 0, luma, row, 0, 1);
            spread(&mut frame, 1, colour, row, 0, 2);
            spread(&mut frame, 2, colour, row, 1, 2);
        }
        _ => spread(&mut frame, 0, bytes, row, 0, 1),
    }
    Some(frame)
}

/// The rows of a plane, with their padding.
fn rows(frame: &mut frame::Video, plane: usize) -> impl Iterator<Item = &mut [u8]> {
    let stride = frame.stride(plane).max(1);
    frame.data_mut(plane).chunks_exact_mut(stride)
}

/// Fills a plane with every `step`th byte, from `first` on, of each row of `row` bytes.
fn spread(
    frame: &mut frame::Video,
    plane: usize,
    bytes: &[u8],
    row: usize,
    first: usize,
    step: usize,
) {
    for (to, from) in rows(frame, plane).zip(bytes.chunks_exact(row)) {
        let picked = from.iter().skip(first).step_by(step);
        for (to, from) in to.iter_mut().zip(picked) {
            *to = *from;
        }
    }
}
