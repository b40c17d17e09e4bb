//! The library's names of pixel formats.

use ::nokhwa::utils::FrameFormat;
use relit_video::PixelFormat;

use crate::camera::Fourcc;

/// The code of what the library calls a format.
pub(super) fn fourcc(format: FrameFormat) -> Option<Fourcc> {
    let mut formats = PixelFormat::ALL.into_iter();
    let found = formats.find(|&known| library_format(known) == Some(format))?;
    Some(Fourcc::of(found))
}

pub(super) fn library_format(wanted: PixelFormat) -> Option<FrameFormat> {
    match wanted {
        PixelFormat::Mjpeg => Some(FrameFormat::MJPEG),
        PixelFormat::Yuyv => Some(FrameFormat::YUYV),
        PixelFormat::Nv12 => Some(FrameFormat::NV12),
        PixelFormat::Grey => Some(FrameFormat::GRAY),
        PixelFormat::Rgb24 => Some(FrameFormat::RAWRGB),
        PixelFormat::H264 | PixelFormat::Bayer(_) => None,
    }
}
