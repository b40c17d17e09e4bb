//! A Matroska file with one track, as FFmpeg makes it.

use ffmpeg_next::codec::{self, Parameters, encoder};
use ffmpeg_next::format::context::{Output, StreamIo};
use ffmpeg_next::{Dictionary, Rational, ffi, format, media};

use crate::{PixelFormat, StreamFormat};

/// Longest duration of a cluster, milliseconds.
const CLUSTER_MS: &str = "400";
/// Most bytes of a cluster, which a fast camera reaches first.
const CLUSTER_BYTES: &str = "16000000";
/// The muxer's time base: parts of a second.
const MILLISECONDS: i32 = 1000;

/// Starts a Matroska file with one track.
pub(super) fn open(
    io: StreamIo,
    stream: &StreamFormat,
    encoder: Option<&encoder::video::Encoder>,
    extradata: Option<&[u8]>,
) -> Result<Output, ffmpeg_next::Error> {
    let mut output = format::output_to_stream(io, None, Some("matroska"))?;
    let rate = Rational::new((stream.fps * 1000.0).round() as i32, 1000);
    let mut parameters = match encoder {
        Some(encoder) => Parameters::from(encoder),
        None => copied(stream)?,
    };
    if let Some(extradata) = extradata {
        set_extradata(&mut parameters, extradata)?;
    }
    let mut track = output.add_stream(codec::Id::None)?;
    track.set_parameters(parameters);
    track.set_time_base(Rational::new(1, MILLISECONDS));
    if rate.numerator() > 0 {
        track.set_avg_frame_rate(rate);
    }
    let mut options = Dictionary::new();
    options.set("cluster_time_limit", CLUSTER_MS);
    options.set("cluster_size_limit", CLUSTER_BYTES);
    drop(output.write_header_with(options)?);
    Ok(output)
}

/// The track of a stream that is stored as the camera delivers it.
fn copied(stream: &StreamFormat) -> Result<Parameters, ffmpeg_next::Error> {
    let mut parameters = Parameters::new();
    parameters.set_medium(media::Type::Video);
    parameters.set_id(codec_id(stream.format));
    let context = codec::Context::from_parameters(parameters)?;
    let mut video = context.encoder().video()?;
    video.set_width(stream.width);
    video.set_height(stream.height);
    Ok(Parameters::from(&video))
}

#[allow(unsafe_code)]
fn set_extradata(parameters: &mut Parameters, bytes: &[u8]) -> Result<(), ffmpeg_next::Error> {
    let no_memory = ffmpeg_next::Error::Other {
        errno: ffmpeg_next::error::ENOMEM,
    };
    let padding = ffi::AV_INPUT_BUFFER_PADDING_SIZE as usize;
    let length = i32::try_from(bytes.len()).map_err(|_| no_memory)?;
    // SAFETY: the buffer is FFmpeg's own allocation with the padding that it asks for, zeroed; the
    // parameters own it from here on and free it. They were made by this module and have none yet.
    unsafe {
        let buffer = ffi::av_mallocz(bytes.len() + padding).cast::<u8>();
        if buffer.is_null() {
            return Err(no_memory);
        }
        std::ptr::copy_nonoverlapping(bytes.as_ptr(), buffer, bytes.len());
        let target = parameters.as_mut_ptr();
        (*target).extradata = buffer;
        (*target).extradata_size = length;
    }
    Ok(())
}

/// Ends the current cluster and writes everything to the sink.
#[allow(unsafe_code)]
pub(super) fn end_cluster(output: &mut Output) -> Result<(), ffmpeg_next::Error> {
    // SAFETY: the context is alive and its header was written; a null packet asks the muxer to
    // flush, which Matroska's supports (AVFMT_ALLOW_FLUSH). `pb` is the sink's, open until the
    // context is dropped.
    let answer = unsafe {
        let answer = ffi::av_write_frame(output.as_mut_ptr(), std::ptr::null_mut());
        ffi::avio_flush((*output.as_mut_ptr()).pb);
        answer
    };
    if answer < 0 {
        return Err(ffmpeg_next::Error::from(answer));
    }
    Ok(())
}

fn codec_id(format: PixelFormat) -> codec::Id {
    match format {
        PixelFormat::Mjpeg => codec::Id::MJPEG,
        PixelFormat::H264 => codec::Id::H264,
        _ => codec::Id::FFV1,
    }
}
