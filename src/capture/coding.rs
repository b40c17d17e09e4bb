//! How a camera's pixel formats are kept in a video.

use crate::camera::{Encoding, Fourcc};
use crate::video::{Coding, RawFormat};

/// The coding of a pixel format; `None` for one that is not taken here.
pub(super) fn of(fourcc: Fourcc) -> Option<Coding> {
    Some(match fourcc.encoding()? {
        Encoding::Mjpeg => Coding::Mjpeg,
        Encoding::H264 => Coding::H264,
        Encoding::Yuyv => Coding::Raw(RawFormat::Yuyv),
        Encoding::Nv12 => Coding::Raw(RawFormat::Nv12),
        Encoding::Rgb24 => Coding::Raw(RawFormat::Rgb24),
        Encoding::Grey => Coding::Raw(RawFormat::Grey),
        Encoding::Bayer(_) => Coding::Raw(RawFormat::Bayer),
    })
}
